#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/exchange/http_service.hpp"

namespace gelslam::test {

inline FileDescriptor connect_to(int port, int receive_bytes = 0) {
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
inline bool say(const FileDescriptor& client, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::send(client.get(), text.data() + done, text.size() - done, MSG_NOSIGNAL);
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

inline std::string hear_until(const FileDescriptor& client, const std::string& end = "") {
  std::string text;
  char bytes[65536];
  for (ssize_t count; (count = ::recv(client.get(), bytes, sizeof bytes, 0)) > 0;) {
    text.append(bytes, static_cast<std::size_t>(count));
    if (!end.empty() && text.find(end) != std::string::npos) break;
  }
  return text;
}

/// A scan that is served, and what a client asks of it.
class Service : public testing::Test {
 protected:
  explicit Service(const ServeOptions& options = {"0", "word"}) : service(serve_scan(options, lines, &mesh)) {
    WatchedScan scan;
    scan.status = [this] { return status; };
    scan.touch = [this] { return touch; };
    scan.map = [this] { return map; };
    scan.ask = [this](ScanCommand command) { asked.push_back(command); };
    watch = service->watch(std::move(scan));
    status.phase = LivePhase::scanning;
  }

  int port() const {
    const std::string& url = service->urls.at(0);
    return std::stoi(url.substr(url.rfind(':') + 1));
  }
  /// Without the token.
  std::string request_of_anybody(const std::string& line,
                                 const std::string& headers = "Host: localhost\r\n") const {
    const FileDescriptor client = connect_to(port());
    say(client, line + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
    return hear_until(client);
  }
  std::string request(const std::string& line, const std::string& headers = "Host: localhost\r\n") const {
    return request_of_anybody(line + (line.find('?') == line.npos ? "?" : "&") + "token=word", headers);
  }
  nlohmann::json changes(const std::string& query) const {
    const std::string answer = body_of(request("GET /changes?" + query));
    std::uint32_t size = 0;
    std::memcpy(&size, answer.data(), 4);
    return nlohmann::json::parse(answer.substr(4, size));
  }
  static std::string body_of(const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); }
  nlohmann::json state() const { return nlohmann::json::parse(body_of(request("GET /status"))); }
  std::int64_t dropped() const { return state().at("clients_dropped"); }

  LineFeed lines;
  MeshFeed mesh;
  LiveStatus status;
  std::shared_ptr<const FrameReport> touch;
  std::shared_ptr<const MapSnapshot> map = std::make_shared<MapSnapshot>();
  std::vector<ScanCommand> asked;
  std::unique_ptr<HttpService> service;
  std::shared_ptr<void> watch;
};

}  // namespace gelslam::test
