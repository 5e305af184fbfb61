#include "serve/http_server.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <chrono>
#include <csignal>
#include <future>
#include <random>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "gelslam/core/error.hpp"

namespace gelslam::exchange::detail {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostClients = 160;
constexpr std::size_t kMostRequests = 10'000;  // of one connection
constexpr std::size_t kBytesAtOnce = 65'536;
constexpr std::chrono::seconds kTimeToTake{5}, kTimeOfAnswer{30}, kTimeToEnd{5};

std::string random_token() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

/// Threads that can be had for clients, half of what the system still grants: httplib's pool would end the
/// program where it gets too few.
std::size_t possible_clients() {
  std::vector<std::jthread> tried;
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future().share();
  const std::shared_ptr<void> at_end(nullptr, [&](void*) { end.set_value(); });
  try {
    while (tried.size() < 2 * kMostClients) tried.emplace_back([ended] { ended.wait(); });
  } catch (const std::system_error&) {
    if (tried.size() < 2) throw;
  }
  return tried.size() / 2;
}

/// Takes as long wherever the texts differ.
bool is_equal(const std::string& a, const std::string& b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

class TokenServer final : public HttpServer {
 public:
  TokenServer(const std::string& host, int wanted_port, const std::string& wanted_token,
              std::map<std::string, HttpHandler> handlers)
      : handlers_(std::move(handlers)) {
    token = wanted_token.empty() ? random_token() : wanted_token;
    set_up();
    listen_at(host, wanted_port);
    thread_ = std::thread([this] {
      sigset_t broken_pipe;  // of clients that have left
      sigemptyset(&broken_pipe);
      sigaddset(&broken_pipe, SIGPIPE);
      pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
      server_.listen_after_bind();
      ended_ = true;
    });
  }

  /// What is being sent goes on for a while: httplib would cut it off.
  ~TokenServer() override {
    const auto wait_while = [](const auto& lasts) {
      while (lasts()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    wait_while([this] { return !server_.is_running() && !ended_; });
    end_ = Clock::now() + kTimeToEnd;
    wait_while([this] { return answers_ > 0 && Clock::now() < end_.load(); });
    server_.stop();
    thread_.join();
  }

 private:
  void set_up() {
    server_.new_task_queue = [clients = possible_clients()] { return new httplib::ThreadPool(clients); };
    server_.set_tcp_nodelay(true);
    server_.set_read_timeout(kTimeToTake);
    server_.set_write_timeout(kTimeToTake);
    server_.set_keep_alive_timeout(1);  // the end waits for it
    server_.set_keep_alive_max_count(kMostRequests);
    server_.set_socket_options([](socket_t socket) {  // httplib's own let two programs listen at one port
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server_.set_default_headers({{"Cache-Control", "no-store"},
                                 {"Content-Security-Policy", "frame-ancestors 'none'"},
                                 {"Cross-Origin-Resource-Policy", "same-origin"},
                                 {"Referrer-Policy", "no-referrer"},
                                 {"X-Content-Type-Options", "nosniff"}});
    // Before httplib reads a body: it would wait for that of a POST that says nothing of one.
    server_.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      ++answers_;
      const std::shared_ptr<void> counted(nullptr, [this](void*) { --answers_; });
      const_cast<httplib::Request&>(request).ranges.clear();  // httplib sends parts as if they were the whole
      send(reply_to(request), counted, response);
      return httplib::Server::HandlerResponse::Handled;
    });
    server_.set_error_handler([this](const httplib::Request&, httplib::Response& response) {
      for (const int refused : {400, 403, 413, 414}) dropped += response.status == refused;
    });
  }

  void listen_at(const std::string& host, int wanted_port) {
    errno = 0;
    port = wanted_port != 0 ? wanted_port : server_.bind_to_any_port(host);
    if (wanted_port != 0 ? server_.bind_to_port(host, port) : port > 0) return;
    const std::string name = "port " + std::to_string(wanted_port);
    if (errno == EADDRINUSE) throw Error(name + " is in use by another program; choose another one");
    if (errno == EACCES) throw Error(name + " needs rights of root; choose one from 1024");
    throw Error("--serve: " + host + " is no address of this machine");
  }

  HttpReply reply_to(const httplib::Request& request) const {
    const std::string own = "http://" + request.get_header_value("Host");
    if (request.has_header("Origin") && request.get_header_value("Origin") != own)
      return {.status = 403, .body = "pages of other sites may not ask\n"};
    if (!is_equal(request.get_param_value("token"), token))
      return {.status = 403,
              .body = "the token is missing or wrong: open the address that gelslam has printed\n"};
    const std::string length = request.get_header_value("Content-Length");
    if (request.has_header("Transfer-Encoding") || (!length.empty() && length != "0"))
      return {.status = 413, .body = "a request has no body here\n"};
    const auto handler =
        handlers_.find((request.method == "HEAD" ? "GET" : request.method) + " " + request.path);
    if (handler == handlers_.end()) return {.status = 404, .body = "there is nothing here\n"};
    return handler->second({request.params.begin(), request.params.end()});
  }

  /// `counted` lives as long as the answer.
  void send(HttpReply reply, const std::shared_ptr<void>& counted, httplib::Response& response) {
    response.status = reply.status;
    if (is_ending()) return response.set_content(reply.body, reply.type);  // no provider is asked any more
    if (reply.pieces) {
      response.set_chunked_content_provider(reply.type, [this, counted, pieces = std::move(reply.pieces)](
                                                            std::size_t, httplib::DataSink& sink) {
        const std::optional<std::string> piece = pieces();
        if (!piece || is_ending()) return sink.done(), true;
        return piece->empty() ? sink.is_writable() : write(*piece, sink, Clock::now() + kTimeToTake);
      });
      return;
    }
    // Not set_content(): it copies, and compresses.
    const auto body = std::make_shared<const std::string>(std::move(reply.body));
    response.set_content_provider(body->size(), reply.type,
                                  [this, counted, body, until = Clock::now() + kTimeOfAnswer](
                                      std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                                    return write(std::string_view(*body).substr(offset, length), sink, until);
                                  });
  }

  /// httplib drops a client that takes nothing for a while; this also one that takes too little.
  bool write(std::string_view bytes, httplib::DataSink& sink, Clock::time_point until) {
    while (!bytes.empty()) {
      const std::size_t count = std::min(kBytesAtOnce, bytes.size());
      const bool is_sent = sink.write(bytes.data(), count);
      const Clock::time_point now = Clock::now();
      dropped += now > until;
      if (!is_sent || now > until || now > end_.load()) return false;
      bytes.remove_prefix(count);
    }
    return true;
  }

  bool is_ending() const { return end_.load() != Clock::time_point::max(); }

  const std::map<std::string, HttpHandler> handlers_;
  httplib::Server server_;
  std::atomic<Clock::time_point> end_{Clock::time_point::max()};
  std::atomic<int> answers_{0};  // that are being sent
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<HttpServer> listen_http(const std::string& host, int port, const std::string& token,
                                        std::map<std::string, HttpHandler> handlers) {
  const auto on_broken_pipe = std::signal(SIGPIPE, SIG_DFL);  // httplib changes it
  auto server = std::make_unique<TokenServer>(host, port, token, std::move(handlers));
  std::signal(SIGPIPE, on_broken_pipe);
  return server;
}

}  // namespace gelslam::exchange::detail
