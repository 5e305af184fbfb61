#include "gelslam/exchange/http_service.hpp"

#include <unistd.h>

#include <atomic>
#include <charconv>
#include <filesystem>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
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
constexpr std::chrono::seconds kTimeToFinish{1}, kTimeToTell{4};

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

/// What a browser on another machine can find.
std::string shown_host(const std::string& host) {
  if (host == "0.0.0.0" || host == "::") {
    char name[256] = "";
    return ::gethostname(name, sizeof name - 1) == 0 && name[0] != 0 ? name : "127.0.0.1";
  }
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

HttpReply refuse(int status, const std::string& why) { return {.status = status, .body = why + "\n"}; }

HttpReply json_reply(const Json& json) {
  return {.type = "application/json",
          .body = json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"};
}

/// Mesh files are large: made at low priority, one at a time.
std::string mesh_file(const MeshFeed& feed, bool as_glb) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  return std::async(std::launch::async,
                    [&]() -> std::string {
                      lower_thread_priority();
                      const Mesh mesh = feed.whole();
                      if (mesh.triangles.empty()) return "";
                      if (!as_glb) return encode_ply(mesh);
                      std::string folder = std::filesystem::temp_directory_path() / "gelslam-XXXXXX";
                      if (::mkdtemp(folder.data()) == nullptr) throw Error("no folder for a temporary file");
                      const std::filesystem::path file = std::filesystem::path(folder) / "mesh.glb";
                      write_mesh(file, mesh);
                      std::string bytes = read_file(file);
                      std::filesystem::remove_all(folder);
                      return bytes;
                    })
      .get();
}

class ScanService final : public HttpService {
 public:
  ScanService(const Address& address, LineFeed& lines, const MeshFeed* mesh) : lines_(lines), mesh_(mesh) {
    const std::lock_guard lock(mutex_);  // the first client may be there before the server is known here
    server_ = listen_http(address.host, address.port, handlers());
    url = "http://" + shown_host(address.host) + ":" + std::to_string(server_->port) + "/";
    if (!server_->token.empty()) url += "?token=" + server_->token;
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
      const bool has_page = now - seen_.load() < kTimeToTell;
      if (now - begin < kTimeToFinish) return readers_ > 0 || has_page;
      return now - begin < kTimeToTell && has_page && !told_;
    };
    while (is_awaited()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }

 private:
  std::map<std::string, HttpHandler> handlers() {
    const auto wish = [this](ScanWish what, const char* done) {
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
        {"POST /stop", wish(ScanWish::stop, "Stopping.")},
        {"POST /new", wish(ScanWish::new_scan, "The new scan begins when this one is saved.")},
    };
  }

  void set(WatchedScan scan) {
    const std::lock_guard lock(mutex_);
    scan_ = std::move(scan);
  }

  /// The newest state.
  Json look() {
    const std::lock_guard lock(mutex_);
    if (scan_.status) {
      const LiveStatus status = scan_.status();
      const std::shared_ptr<const MapSnapshot> map = scan_.map ? scan_.map() : nullptr;
      touch_ = scan_.touch();
      const bool touches = touch_ && status.phase < LivePhase::finishing;
      last_ = status_json(status);
      last_["frame"] = touch_ ? Json(touch_->frame) : Json(nullptr);
      last_["touch"] = touches ? touch_json(*touch_, map.get()) : Json(nullptr);
      last_["surface"] = mesh_ != nullptr;
      last_["scan"] = scan_.is_scan;
      last_["another"] = scan_.another;
    }
    last_["clients_dropped"] = server_->dropped.load();
    return last_;
  }

  HttpReply poses(const HttpQuery& query) {
    const auto format = query.find("format");
    const std::string name = format == query.end() ? "ndjson" : format->second;
    if (name != "ndjson" && name != "tum") return refuse(400, "format=" + name + ": should be ndjson or tum");
    const LineWishes wishes{name == "tum", query.contains("surface"), query.contains("images")};
    const std::shared_ptr<void> counted(nullptr, [this](void*) { --readers_; });
    ++readers_;
    return {.type = wishes.tum ? "text/plain" : "application/x-ndjson",
            .pieces = [reader = lines_.open(wishes), counted] {
              return reader->next(Clock::now() + std::chrono::seconds(1));
            }};
  }

  /// For the page, in one answer: the state, and what has changed in the mesh.
  HttpReply changes(const HttpQuery& query) {
    std::uint64_t since = 0;
    if (const auto found = query.find("since"); found != query.end())
      std::from_chars(found->second.data(), found->second.data() + found->second.size(), since);
    seen_ = Clock::now();
    MeshFeed::Changes changes;
    if (mesh_ != nullptr) changes = mesh_->since(since, kVerticesAtOnce);
    Json json = look();
    told_ = json["phase"] == "finished" && changes.version == changes.newest;
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

  HttpReply mesh_reply(bool as_glb) {
    std::string bytes = mesh_ != nullptr ? mesh_file(*mesh_, as_glb) : "";
    if (bytes.empty())
      return refuse(404, mesh_ != nullptr ? "there is no surface yet" : "no surface is made here");
    return {.type = as_glb ? "model/gltf-binary" : "application/octet-stream", .body = std::move(bytes)};
  }

  HttpReply ask(ScanWish wish, const char* done) {
    const std::lock_guard lock(mutex_);
    if (!scan_.ask) return refuse(409, "The scan is over.");
    if (wish != ScanWish::stop && !scan_.is_scan)
      return refuse(409, "This is no scan: it can be stopped only.");
    const std::string why = refusal(wish, scan_.status(), scan_.another);
    if (!why.empty()) return refuse(409, why);
    scan_.ask(wish);
    return {.body = std::string(done) + "\n"};
  }

  LineFeed& lines_;
  const MeshFeed* mesh_;
  std::atomic<int> readers_{0};
  std::atomic<bool> told_{false};                             // a page knows the end
  std::atomic<Clock::time_point> seen_{Clock::time_point{}};  // when a page last looked

  std::mutex mutex_;  // for what follows
  WatchedScan scan_;
  Json last_ = {
      {"phase", "background"}, {"state", "background"}, {"tone", "gray"}, {"headline", "Getting ready"}};
  std::shared_ptr<const LiveTouch> touch_, pictured_;
  std::string jpeg_;
  std::unique_ptr<HttpServer> server_;
};

}  // namespace

std::unique_ptr<HttpService> serve_scan(const std::string& address, LineFeed& lines, const MeshFeed* mesh) {
  return std::make_unique<ScanService>(parse_address(address), lines, mesh);
}

}  // namespace gelslam
