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

/// HTTP server (cpp-httplib) for up to 64 clients, and no more than a quarter of the file descriptors, each
/// on its own thread. A further client replaces the one that has waited longest without a request, and is
/// refused if all are being answered. A client is dropped if its request is not complete within 5 s or has
/// more than 16 kB, if it does not ask again within 1 s, if it accepts nothing for 5 s, and if it does not
/// accept an answer within 30 s or a chunk within 5 s. Requests without the token, with a body, or from pages
/// of other sites are refused.
class HttpServer {
 public:
  /// Waits for answers in progress, for 3 s at most.
  virtual ~HttpServer() = default;

  int port = 0;
  std::string token;
  std::atomic<std::int64_t> dropped{0};  ///< Refused requests, and clients that were too many or too slow.
};

/// Starts a server. `handlers` are indexed by "GET /path". Port 0 means any free one; an empty token means a
/// random one. Throws Error when it cannot listen at the address.
std::unique_ptr<HttpServer> listen_http(const std::string& host, int port, const std::string& token,
                                        std::map<std::string, HttpHandler> handlers);

}  // namespace gelslam::exchange::detail
