#include "gelslam/exchange/http_service.hpp"

#include <fmt/core.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <charconv>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "page_template.hpp"
#include "serve/http_server.hpp"
#include "serve/scan_page.hpp"

namespace gelslam {

using namespace exchange::detail;

namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kVerticesAtOnce = 60'000;  // 2 MB
constexpr std::chrono::seconds kTimeToFinish{1}, kTimeToTell{10};
// A page counts as open for this long after its last request.
constexpr std::chrono::seconds kPageIsOpen{4};

struct Address {
  std::string host = "127.0.0.1";
  int port = -1;
};

Address parse_address(const std::string& text) {
  Address address;
  const std::size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (colon != std::string::npos) address.host = text.substr(0, colon);
  if (address.host.starts_with('[') && address.host.ends_with(']'))
    address.host = address.host.substr(1, address.host.size() - 2);
  const char* end = port.data() + port.size();
  const auto [stopped, failure] = std::from_chars(port.data(), end, address.port);
  if (failure != std::errc() || stopped != end || address.port < 0 || address.port > 65535 ||
      address.host.empty())
    throw Error("--serve " + text +
                ": should be PORT or HOST:PORT; a port is a number from 1 to 65535 (0: any free one)");
  return address;
}

/// Returns the addresses of this computer as browsers on other computers name them.
std::vector<std::string> own_addresses(int family) {
  std::vector<std::string> names;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return {"127.0.0.1"};
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> all(first, ::freeifaddrs);
  for (const ifaddrs* at = first; at != nullptr; at = at->ifa_next) {
    char name[NI_MAXHOST] = "";
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != family) continue;
    ::getnameinfo(at->ifa_addr, family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6), name,
                  sizeof name, nullptr, 0, NI_NUMERICHOST);
    // Such addresses are usable only together with an interface.
    if (!std::string_view(name).starts_with("fe80:")) names.emplace_back(name);
  }
  return names;
}

std::vector<std::string> shown_hosts(const std::string& host) {
  if (host == "0.0.0.0") return own_addresses(AF_INET);
  if (host == "::") return own_addresses(AF_INET6);
  return {host};
}

void check_token(const std::string& token, const std::string& host) {
  constexpr std::size_t kMinLetters = 8;  // Corresponds to 47 bits.
  const bool is_local = host.starts_with("127.") || host == "::1" || host == "localhost";
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
  if (!std::all_of(token.begin(), token.end(), fits))
    throw Error("--token " + token + ": should have letters of English, digits, - and _ only");
  if (!is_local && !token.empty() && token.size() < kMinLetters)
    throw Error("--token: others can guess it; give at least " + std::to_string(kMinLetters) +
                " letters, or none for a random one");
}

HttpReply refuse(int status, const std::string& why) { return {.status = status, .body = why + "\n"}; }

HttpReply json_reply(const Json& json) {
  return {.type = "application/json",
          .body = json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"};
}

/// Encodes the whole mesh at low priority; "" if there is none.
std::string mesh_file(const MeshFeed& feed, bool as_glb) {
  const auto make = [&] {
    lower_thread_priority();
    const Mesh mesh = feed.whole();
    return mesh.triangles.empty() ? "" : encode_mesh(mesh, as_glb ? ".glb" : ".ply");
  };
  return std::async(std::launch::async, make).get();
}

class ScanService final : public HttpService {
 public:
  ScanService(const ServeOptions& options, const Address& address, LineFeed& lines, const MeshFeed* mesh)
      : has_tum_(options.tum), lines_(lines), mesh_(mesh) {
    const std::lock_guard lock(mutex_);  // The first client may connect before server_ is set.
    server_ = listen_http(address.host, address.port, options.token, handlers());
    for (const std::string& host : shown_hosts(address.host))
      urls.push_back(fmt::format("http://{}:{}/?token={}",
                                 host.find(':') == host.npos ? host : "[" + host + "]", server_->port,
                                 server_->token));
  }

  std::shared_ptr<void> watch(WatchedScan scan) override {
    set(std::move(scan));
    return {this, [this](void*) {
              look();
              set({});
            }};
  }

  void finish() override {
    const auto begin = Clock::now();
    const auto is_awaited = [&] {
      const Clock::time_point now = Clock::now();
      if (now - begin < kTimeToFinish && readers_ > 0) return true;
      const std::lock_guard lock(mutex_);
      return now - begin < kTimeToTell && std::any_of(pages_.begin(), pages_.end(), [&](const auto& page) {
               return !page.second.told && now - page.second.seen < kPageIsOpen;
             });
    };
    while (is_awaited()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }

 private:
  std::map<std::string, HttpHandler> handlers() {
    const auto command = [this](ScanCommand what, const char* done) {
      return [=, this](const HttpQuery&) { return ask(what, done); };
    };
    return {
        {"GET /",
         [](const HttpQuery&) { return HttpReply{.type = "text/html; charset=utf-8", .body = kScanPage}; }},
        {"GET /poses", [this](const HttpQuery& query) { return poses(query); }},
        {"GET /status", [this](const HttpQuery&) { return json_reply(look()); }},
        {"GET /changes", [this](const HttpQuery& query) { return changes(query); }},
        {"GET /picture.jpg", [this](const HttpQuery&) { return picture(); }},
        {"GET /mesh.ply", [this](const HttpQuery&) { return mesh_reply(false); }},
        {"GET /mesh.glb", [this](const HttpQuery&) { return mesh_reply(true); }},
        {"POST /stop", command(ScanCommand::stop, "Stopping.")},
        {"POST /new", command(ScanCommand::new_scan, "The new scan begins when this one is saved.")},
    };
  }

  void set(WatchedScan scan) {
    const std::lock_guard lock(mutex_);
    scan_ = std::move(scan);
  }

  /// Returns the newest state of the scan.
  Json look() {
    const std::lock_guard lock(mutex_);
    if (scan_.status) {
      const LiveStatus status = scan_.status();
      map_ = scan_.map ? scan_.map() : nullptr;
      touch_ = scan_.touch();
      const bool touches = touch_ && status.phase < LivePhase::finishing;
      last_ = status_json(status);
      last_["frame"] = touch_ ? Json(touch_->tracked.frame) : Json(nullptr);
      last_["touch"] = touches ? touch_json(*touch_, map_.get()) : Json(nullptr);
      last_["surface"] = mesh_ != nullptr;
      last_["scan"] = status.is_scan;
      last_["another"] = scan_.another;
    }
    last_["clients_dropped"] = server_->dropped.load();
    return last_;
  }

  HttpReply poses(const HttpQuery& query) {
    const auto format = query.find("format");
    const std::string name = format == query.end() ? "ndjson" : format->second;
    if (name != "ndjson" && (name != "tum" || !has_tum_))
      return refuse(400, "format=" + name + ": should be ndjson" + (has_tum_ ? " or tum" : ""));
    const StreamOptions options{name == "tum", query.contains("surface"), query.contains("images")};
    const std::shared_ptr<void> counted(nullptr, [this](void*) { --readers_; });
    ++readers_;
    // Lowers the priority of this client's thread, which may encode images.
    if (options.images) lower_thread_priority();
    return {.type = options.tum ? "text/plain" : "application/x-ndjson",
            .chunks = [reader = lines_.open(options), counted] {
              return reader->next(Clock::now() + std::chrono::seconds(1));
            }};
  }

  /// Returns in one answer for the page: the state, and what has changed in the mesh.
  HttpReply changes(const HttpQuery& query) {
    const auto asked = [&](const char* name) {
      const auto found = query.find(name);
      return found == query.end() ? "" : found->second;
    };
    // Browsers delay the timers of hidden pages by up to a minute, but not their requests.
    const bool knows_end = asked("phase") == "finished";
    if (asked("hidden") == "1" && !knows_end) std::this_thread::sleep_for(std::chrono::seconds(1));
    const std::string text = asked("since");
    std::uint64_t since = 0;
    std::from_chars(text.data(), text.data() + text.size(), since);
    MeshFeed::Changes changes;
    // Read before the mesh, so that the state `finished` is sent together with the last mesh.
    Json json = look();
    if (mesh_ != nullptr) changes = mesh_->since(since, kVerticesAtOnce);
    const std::lock_guard lock(mutex_);
    const Clock::time_point now = Clock::now();
    std::erase_if(pages_, [&](const auto& page) { return now - page.second.seen > kPageIsOpen; });
    Page& page = pages_[asked("page")];
    const bool has_map = page.map && std::to_string(page.map->version) == asked("map");
    if (map_) json["map"] = std::to_string(map_->version);
    if (map_ && !(has_map && page.map == map_))
      json["path"] = path_json(*map_, has_map ? page.map.get() : nullptr);
    page = {now, knows_end && since == changes.newest, map_};
    return {.type = "application/octet-stream", .body = encode_changes(std::move(json), changes)};
  }

  HttpReply picture() {
    const std::lock_guard lock(mutex_);
    if (scan_.touch) touch_ = scan_.touch();
    if (!touch_ || touch_->image.empty()) return refuse(404, "there is no picture yet");
    if (touch_ != pictured_) {
      const std::vector<std::uint8_t> bytes = encode_jpeg(touch_->image);
      jpeg_.assign(bytes.begin(), bytes.end());
      pictured_ = touch_;
    }
    return {.type = "image/jpeg", .body = jpeg_};
  }

  /// Files are large and are encoded one at a time; if several clients wait, one of them encodes the next
  /// file for all.
  HttpReply mesh_reply(bool as_glb) {
    if (mesh_ == nullptr) return refuse(404, "no surface is made here");
    const auto newest = [this] { return mesh_->since(0, 0).newest; };
    const std::uint64_t asked = newest();
    const std::lock_guard lock(files_mutex_);
    auto& [version, bytes] = files_[as_glb];
    if (version < asked) {
      version = newest();
      bytes = mesh_file(*mesh_, as_glb);
    }
    if (bytes.empty()) return refuse(404, "there is no surface yet");
    return {.type = as_glb ? "model/gltf-binary" : "application/octet-stream", .body = bytes};
  }

  HttpReply ask(ScanCommand command, const char* done) {
    const std::lock_guard lock(mutex_);
    if (!scan_.ask) return refuse(409, "The scan is over.");
    const std::string why = refusal(command, scan_.status(), scan_.another);
    if (!why.empty()) return refuse(409, why);
    scan_.ask(command);
    return {.body = std::string(done) + "\n"};
  }

  const bool has_tum_;
  LineFeed& lines_;
  const MeshFeed* mesh_;
  std::atomic<int> readers_{0};
  std::mutex files_mutex_;
  // PLY and GLB, each with the version of the mesh that it contains.
  std::pair<std::uint64_t, std::string> files_[2];

  struct Page {
    Clock::time_point seen;  // Time of its last request.
    bool told;               // True if the page has confirmed that it has the end, with the last mesh.
    std::shared_ptr<const MapSnapshot> map;  // Map that was sent last; may be null.
  };
  std::mutex mutex_;  // Protects the members below.
  std::map<std::string, Page> pages_;
  WatchedScan scan_;
  Json last_ = {
      {"phase", "background"}, {"state", "background"}, {"tone", "gray"}, {"headline", "Getting ready"}};
  std::shared_ptr<const FrameReport> touch_, pictured_;
  std::shared_ptr<const MapSnapshot> map_;
  std::string jpeg_;
  std::unique_ptr<HttpServer> server_;
};

}  // namespace

std::unique_ptr<HttpService> serve_scan(const ServeOptions& options, LineFeed& lines, const MeshFeed* mesh) {
  const Address address = parse_address(options.address);
  check_token(options.token, address.host);
  return std::make_unique<ScanService>(options, address, lines, mesh);
}

}  // namespace gelslam
