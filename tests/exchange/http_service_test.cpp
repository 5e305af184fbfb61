// The service of a scan: what it answers, and clients that mean no good.

#include "gelslam/exchange/http_service.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/process.hpp"

namespace gelslam {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using namespace std::chrono_literals;

FileDescriptor connect_to(int port, int receive_bytes = 0) {
  FileDescriptor client(::socket(AF_INET, SOCK_STREAM, 0));
  if (receive_bytes > 0)
    ::setsockopt(client.get(), SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  const timeval patience{20, 0};
  ::setsockopt(client.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  return client;
}

/// False when the other side has closed.
bool say(const FileDescriptor& client, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::send(client.get(), text.data() + done, text.size() - done, MSG_NOSIGNAL);
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

std::string hear_until(const FileDescriptor& client, const std::string& end = "") {
  std::string text;
  char bytes[65536];
  for (ssize_t count; (count = ::recv(client.get(), bytes, sizeof bytes, 0)) > 0;) {
    text.append(bytes, static_cast<std::size_t>(count));
    if (!end.empty() && text.find(end) != std::string::npos) break;
  }
  return text;
}

class Service : public testing::Test {
 protected:
  explicit Service(const std::string& address = "0") : service(serve_scan(address, lines, &mesh)) {
    WatchedScan scan;
    scan.status = [this] { return status; };
    scan.touch = [this] { return touch; };
    scan.map = [] { return std::make_shared<const MapSnapshot>(); };
    scan.ask = [this](ScanWish wish) { asked.push_back(wish); };
    watch = service->watch(std::move(scan));
    status.phase = LivePhase::scanning;
  }

  int port() const {
    const std::string& url = service->url;
    return std::stoi(url.substr(url.rfind(':') + 1));
  }
  std::string request(const std::string& line, const std::string& headers = "Host: localhost\r\n") const {
    const FileDescriptor client = connect_to(port());
    say(client, line + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
    return hear_until(client);
  }
  static std::string body_of(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }
  json state() const { return json::parse(body_of(request("GET /status"))); }
  std::int64_t dropped() const { return state().at("clients_dropped"); }

  LineFeed lines;
  MeshFeed mesh;
  LiveStatus status;
  std::shared_ptr<const LiveTouch> touch;
  std::vector<ScanWish> asked;
  std::unique_ptr<HttpService> service;
  std::shared_ptr<void> watch;
};

TEST_F(Service, TellsTheStateInTheWordsOfTheWindow) {
  status.track = TrackStatus::lost;
  status.words = "lost: too little overlap; touch a place you have seen";
  status.warnings = {"the disk is full"};
  const json said = state();
  EXPECT_EQ(said.at("headline"), "Lost");
  EXPECT_EQ(said.at("advice"), "Too little overlap. Touch a place you have seen.");
  EXPECT_EQ(said.at("tone"), "red");
  EXPECT_EQ(said.at("warnings"), json({"The disk is full."}));
  const std::string page = request("GET /");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  for (const char* word : {"http:", "https:", "src=", "import("})
    EXPECT_EQ(page.find(word), std::string::npos) << "the page needs no network";
  EXPECT_THAT(request("GET /nothing"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(request("GET /picture.jpg"), HasSubstr("there is no picture yet"));
}

TEST_F(Service, GrantsWishesThatTheScanCanFulfill) {
  EXPECT_THAT(request("GET /stop"), StartsWith("HTTP/1.1 404")) << "a link must not stop a scan";
  for (const char* path : {"/undo", "/save"})
    EXPECT_THAT(request(std::string("POST ") + path), StartsWith("HTTP/1.1 404")) << path;
  EXPECT_THAT(request("POST /new"), StartsWith("HTTP/1.1 409"));
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("POST /stop"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(asked, std::vector{ScanWish::stop});
  status.phase = LivePhase::finished;
  EXPECT_THAT(request("POST /stop"), HasSubstr("The scan is over."));
  watch.reset();
  EXPECT_THAT(request("POST /stop"), StartsWith("HTTP/1.1 409"));
  EXPECT_EQ(state().at("headline"), "Finished") << "what was last";
}

TEST_F(Service, GivesLinesAsTheyCome) {
  const FileDescriptor client = connect_to(port()), tum = connect_to(port());
  say(client, "GET /poses HTTP/1.1\r\nHost: localhost\r\n\r\n");
  say(tum, "GET /poses?format=tum HTTP/1.1\r\nHost: localhost\r\n\r\n");
  hear_until(client, "\r\n\r\n");
  hear_until(tum, "\r\n\r\n");
  std::this_thread::sleep_for(1200ms);  // nothing comes for a while
  StreamedFrame frame;
  frame.ndjson = "{\"frame\":1}\n";
  frame.tum = "0.1 2 3\n";
  lines.write(frame);
  EXPECT_THAT(hear_until(client, "\n\r\n"), HasSubstr("{\"frame\":1}\n"));
  EXPECT_THAT(hear_until(tum, "\n\r\n"), HasSubstr("0.1 2 3\n"));
  lines.close();
  EXPECT_THAT(hear_until(client, "0\r\n\r\n"), HasSubstr("0\r\n\r\n")) << "ends as HTTP ends";
  EXPECT_THAT(request("GET /poses?format=xml"), HasSubstr("should be ndjson or tum"));
}

TEST_F(Service, GivesTheMeshWholeAndInBlocks) {
  EXPECT_THAT(request("GET /mesh.ply"), HasSubstr("there is no surface yet"));
  MeshBlock block;
  block.key = 5;
  block.mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  block.mesh.normals.assign(3, {0, 0, -1});
  block.mesh.triangles = {{0, 1, 2}};
  mesh.add(false, {block});
  EXPECT_THAT(body_of(request("GET /mesh.ply")), StartsWith("ply"));
  EXPECT_THAT(body_of(request("GET /mesh.glb")), StartsWith("glTF"));
  const std::string changes = body_of(request("GET /changes?since=0"));
  std::uint32_t size = 0;
  std::memcpy(&size, changes.data(), 4);
  const json head = json::parse(changes.substr(4, size));
  EXPECT_EQ(head.at("blocks"), json::array({json::array({"5", 3, 3})}))
      << "keys have more digits than numbers in JavaScript";
  ASSERT_EQ(changes.size(), 4 + size + 36 + 12 + 12);
  float y = 0;
  std::memcpy(&y, changes.data() + 4 + size + 28, 4);
  EXPECT_EQ(y, 2);
  EXPECT_EQ(static_cast<signed char>(changes[4 + size + 36 + 2]), -127);
  EXPECT_EQ(changes[4 + size + 48 + 4], 1);
  const std::string nothing = request("GET /changes?since=" + head.at("version").dump());
  EXPECT_THAT(nothing, HasSubstr("\"blocks\":[]"));
}

TEST_F(Service, RefusesOtherSites) {
  const std::string own = "Host: 127.0.0.1:" + std::to_string(port()) + "\r\n";
  EXPECT_THAT(request("GET /status", own), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(request("GET /status", "Host: evil.example\r\n"), StartsWith("HTTP/1.1 403"))
      << "DNS rebinding";
  EXPECT_THAT(request("GET /status", ""), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(request("POST /stop", own + "Origin: http://evil.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(request("POST /stop", own + "Origin: null\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("POST /stop", own + "Origin: http://127.0.0.1:" + std::to_string(port()) + "\r\n"),
              StartsWith("HTTP/1.1 200"));
}

class OpenService : public Service {
 protected:
  OpenService() : Service("0.0.0.0:0") {}
  std::string token() const { return service->url.substr(service->url.rfind('=') + 1); }
};

TEST_F(OpenService, NeedsItsTokenForEverything) {
  EXPECT_EQ(token().size(), 32u);
  std::string wrong = token();
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  for (const std::string path : {"GET /", "GET /poses", "GET /mesh.ply", "POST /stop"}) {
    EXPECT_THAT(request(path), StartsWith("HTTP/1.1 403")) << path;
    EXPECT_THAT(request(path + "?token=" + wrong), StartsWith("HTTP/1.1 403")) << path;
  }
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("POST /stop?token=" + token()), StartsWith("HTTP/1.1 200"));
}

TEST_F(Service, DropsRequestsThatAreTooLarge) {
  const std::int64_t before = dropped();
  std::string many = "GET /status HTTP/1.1\r\nHost: localhost\r\n";
  for (int k = 0; k < 10'000; ++k) many += "X-" + std::to_string(k) + ": y\r\n";
  for (const std::string& text :
       {many + "\r\n", "GET /" + std::string(1 << 22, 'a'),
        "GET /status HTTP/1.1\r\nA: " + std::string(1 << 22, 'a'),
        "POST /stop HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n" +
            std::string("fffffff\r\n") + std::string(1 << 22, 'a')}) {
    const FileDescriptor client = connect_to(port());
    say(client, text);
    EXPECT_EQ(hear_until(client).find("HTTP/1.1 200"), std::string::npos);
  }
  EXPECT_TRUE(asked.empty());
  EXPECT_GE(dropped(), before + 3);
}

TEST_F(Service, ManyRangesAreNoProblem) {
  std::string ranges = "Range: bytes=0-1";
  while (ranges.size() < 8000) ranges += ",0-1";
  request("GET /", "Host: localhost\r\n" + ranges + "\r\n");
  EXPECT_THAT(request("GET /status"), StartsWith("HTTP/1.1 200"));
}

TEST_F(Service, ClientsThatDoNothingKeepNobodyOut) {
  const double memory_mb = resident_memory_mb();
  std::vector<FileDescriptor> idle;
  for (int k = 0; k < 200; ++k) {
    idle.push_back(connect_to(port()));
    if (k % 2 == 0) say(idle.back(), "GET /status HT");  // half a request
  }
  const auto begin = std::chrono::steady_clock::now();
  bool answered = false;
  while (!answered && std::chrono::steady_clock::now() - begin < 15s) {
    answered = request("GET /status").starts_with("HTTP/1.1 200");
    if (!answered) std::this_thread::sleep_for(200ms);
  }
  EXPECT_TRUE(answered);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 8s) << "5 s for a request, on a busy machine";
  EXPECT_GT(dropped(), 40) << "more than there is room for, and half requests";
  EXPECT_LT(resident_memory_mb() - memory_mb, 50);
}

TEST_F(Service, AReaderThatStallsDelaysNobodyAndIsDropped) {
  const FileDescriptor stalled = connect_to(port(), 4096), quick = connect_to(port());
  for (const FileDescriptor* client : {&stalled, &quick}) {
    say(*client, "GET /poses HTTP/1.1\r\nHost: localhost\r\n\r\n");
    hear_until(*client, "\r\n\r\n");
  }
  StreamedFrame large;
  large.ndjson = std::string(100'000, 'x') + "\n";
  for (int k = 0; k < 100; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    lines.write(large);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 500ms);
    EXPECT_THAT(hear_until(quick, "\n\r\n"), HasSubstr("xxx"));
  }
  for (int k = 0; k < 100 && dropped() == 0; ++k) std::this_thread::sleep_for(100ms);
  EXPECT_EQ(dropped(), 1);
}

std::string refusal_of(const std::string& address) {
  LineFeed lines;
  try {
    serve_scan(address, lines, nullptr);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(Service, RefusesInOneLineWhatCannotBe) {
  const std::string taken = std::to_string(port());
  EXPECT_EQ(refusal_of(taken), "port " + taken + " is in use by another program; choose another one");
  for (const char* address : {"", "x", "-1", "70000", "80a", ":80", "localhost:"})
    EXPECT_THAT(refusal_of(address), HasSubstr("a port is a number from 1 to 65535")) << address;
  EXPECT_THAT(refusal_of("203.0.113.7:0"), HasSubstr("is no address of this machine"));
  EXPECT_EQ(refusal_of("localhost:0"), "accepted");
  EXPECT_THAT(request("GET /changes?since=-1"), StartsWith("HTTP/1.1 200"));
}

}  // namespace
}  // namespace gelslam
