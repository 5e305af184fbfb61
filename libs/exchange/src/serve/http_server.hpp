#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace gelslam::exchange::detail {

using HttpQuery = std::map<std::string, std::string>;

struct HttpReply {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body = {};
  /// Replaces the body: returns one chunk after another. It waits for the next chunk for about a second at
  /// most, and returns "" if there is none yet, and nothing at the end.
  std::function<std::optional<std::string>()> chunks = {};
};

using HttpHandler = std::function<HttpReply(const HttpQuery&)>;

/// HTTP server (cpp-httplib) for up to 64 clients, each on its own thread; a further client replaces the one
/// that has been idle for the longest time. A client is dropped if it sends no request within 5 s or more
/// than 16 kB, if it accepts nothing for 5 s, and if it does not accept an answer within 30 s or a chunk
/// within 5 s. Requests without the token, with a body, or from pages of other sites are refused.
class HttpServer {
 public:
  /// Waits for answers in progress, for 3 s at most.
  virtual ~HttpServer() = default;

  int port = 0;
  std::string token;
  std::atomic<std::int64_t> dropped{0};  ///< Clients that were dropped or refused.
};

/// Starts a server. `handlers` are indexed by "GET /path". Port 0 means any free one; an empty token means a
/// random one. Throws Error when it cannot listen at the address.
std::unique_ptr<HttpServer> listen_http(const std::string& host, int port, const std::string& token,
                                        std::map<std::string, HttpHandler> handlers);

}  // namespace gelslam::exchange::detail
