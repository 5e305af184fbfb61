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
  /// In place of the body: piece after piece. Waits for the next one for about a second at most; "": there is
  /// none yet; nothing: the end.
  std::function<std::optional<std::string>()> pieces = {};
};

using HttpHandler = std::function<HttpReply(const HttpQuery&)>;

/// HTTP (cpp-httplib) for clients that nobody trusts. At most 160 of them, each on a thread of its own. A
/// request has to arrive within 5 s and 16 kB, an answer to be taken within 30 s, a piece within 5 s; who
/// does not, is dropped. Refused are requests without the token, where there is none those that name another
/// host than an address or localhost (DNS rebinding), and those of other sites' pages.
class HttpServer {
 public:
  /// Waits for answers that are being sent.
  virtual ~HttpServer() = default;

  int port = 0;
  std::string token;                     ///< "": none is needed
  std::atomic<std::int64_t> dropped{0};  ///< clients that were dropped or refused
};

/// `handlers` by "GET /path". Another host than 127.0.0.1, ::1 and localhost makes a token. Port 0: any free
/// one. Throws Error when it cannot listen there.
std::unique_ptr<HttpServer> listen_http(const std::string& host, int port,
                                        std::map<std::string, HttpHandler> handlers);

}  // namespace gelslam::exchange::detail
