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
  /// In place of the body: chunk after chunk. Waits for the next one for about a second at most; "": there is
  /// none yet; nothing: the end.
  std::function<std::optional<std::string>()> chunks = {};
};

using HttpHandler = std::function<HttpReply(const HttpQuery&)>;

/// HTTP (cpp-httplib) for 64 clients at a time, each on a thread; for another one the one goes that has not
/// asked for the longest time. Who does not ask within 5 s, in 16 kB, is dropped, who takes nothing for 5 s,
/// and who does not take an answer within 30 s, a chunk within 5 s. Refused are requests without the token,
/// with a body, and those of other sites' pages.
class HttpServer {
 public:
  /// Waits for answers that are being sent, for 3 s at most.
  virtual ~HttpServer() = default;

  int port = 0;
  std::string token;
  std::atomic<std::int64_t> dropped{0};  ///< clients that were dropped or refused
};

/// `handlers` by "GET /path". Port 0: any free one; token "": a random one. Throws Error when it cannot
/// listen there.
std::unique_ptr<HttpServer> listen_http(const std::string& host, int port, const std::string& token,
                                        std::map<std::string, HttpHandler> handlers);

}  // namespace gelslam::exchange::detail
