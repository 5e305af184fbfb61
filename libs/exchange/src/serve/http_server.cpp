#include "serve/http_server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <poll.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <list>
#include <mutex>
#include <random>
#include <system_error>
#include <thread>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"

namespace gelslam::exchange::detail {
namespace {

using Clock = std::chrono::steady_clock;

constexpr rlim_t kMaxClients = 64;
constexpr std::size_t kMaxRequests = 10'000;  // Limit for one connection.
constexpr std::size_t kMaxBytes = 16 * 1024;  // Limit for one request.
constexpr std::size_t kBytesAtOnce = 65'536;
constexpr std::chrono::seconds kTimeToTake{5}, kTimeOfAnswer{30}, kTimeToEnd{3}, kTimeToAskAgain{1},
    kTimeToLeave{1};

std::string random_token() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

/// Returns how many file descriptors clients may use; the rest is for files.
std::ptrdiff_t most_clients() {
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  return static_cast<std::ptrdiff_t>(std::clamp<rlim_t>(files.rlim_cur / 4, 1, kMaxClients));
}

bool wait_for(int socket, short what, Clock::time_point until) {
  pollfd waiting{socket, what, 0};
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
  return ::poll(&waiting, 1, static_cast<int>(std::max<std::int64_t>(left, 0))) > 0;
}

/// One request and its answer. It replaces httplib's own stream, which waits for the next byte of a request
/// as long as bytes keep coming, and stores lines of any length.
class RequestStream final : public httplib::Stream {
 public:
  explicit RequestStream(int client) : socket_(client) {}

  bool is_readable() const override { return wait_for(socket_, POLLIN, until_); }
  bool is_writable() const override {
    char byte = 0;
    return wait_for(socket_, POLLOUT, Clock::now() + kTimeToTake) &&
           ::recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT) != 0;
  }
  ssize_t read(char* bytes, std::size_t size) override {
    size = std::min(size, bytes_left_);
    const ssize_t count = size > 0 && is_readable() ? ::recv(socket_, bytes, size, MSG_DONTWAIT) : -1;
    if (count > 0) bytes_left_ -= static_cast<std::size_t>(count);
    return count;
  }
  ssize_t write(const char* bytes, std::size_t size) override {
    return is_writable() ? ::send(socket_, bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL) : -1;
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_; }

 private:
  const int socket_;
  const Clock::time_point until_ = Clock::now() + kTimeToTake;
  std::size_t bytes_left_ = kMaxBytes;
};

/// A connection with its own thread.
struct Client {
  static constexpr Clock::time_point kIsAnswered = Clock::time_point::max();

  explicit Client(int connection) : socket(connection) {}
  void hang_up() {
    is_over = true;
    ::shutdown(socket.get(), SHUT_RDWR);
  }

  FileDescriptor socket;
  std::atomic<Clock::time_point> asks_since{Clock::now()};
  std::atomic<bool> is_over{false}, is_gone{false};
  std::jthread thread;
};

/// httplib's server, changed so that idle clients cannot keep others out.
class Server : public httplib::Server {
 public:
  explicit Server(std::atomic<std::int64_t>& dropped) : dropped_(dropped) {
    new_task_queue = [] { return new AtOnce; };
  }

  /// By default httplib lets only five connections wait, and Linux delays further ones by a second or more.
  void let_many_wait() { ::listen(svr_sock_, SOMAXCONN); }
  bool answers() const {
    const std::lock_guard lock(mutex_);
    return std::ranges::any_of(
        clients_, [](const auto& client) { return client->asks_since.load() == Client::kIsAnswered; });
  }
  /// To be called after listening has ended.
  void hang_up() {
    {
      const std::lock_guard lock(mutex_);
      for (const auto& client : clients_) client->hang_up();
    }
    clients_.clear();
  }

 private:
  struct AtOnce : httplib::TaskQueue {
    void enqueue(std::function<void()> work) override { work(); }
    void shutdown() override {}
  };

  /// If there are too many clients, the one that has been idle for the longest time is dropped.
  bool process_and_close_socket(socket_t socket) override {
    auto client = std::make_unique<Client>(socket);
    std::unique_lock lock(mutex_);
    // The threads of clients that were hung up take a while to end, longer on a busy machine.
    const bool has_room = client_left_.wait_for(lock, kTimeToLeave, [this] {
      std::erase_if(clients_, [](const auto& left) { return left->is_gone.load(); });
      return std::ssize(clients_) <= 2 * most_;
    });
    if (!has_room) return ++dropped_, false;
    if (std::ranges::count_if(clients_, [](const auto& one) { return !one->is_over; }) >= most_) {
      ++dropped_;
      const auto& idle = *std::ranges::min_element(clients_, {}, [](const auto& one) {
        return one->is_over ? Client::kIsAnswered : one->asks_since.load();
      });
      if (idle->asks_since.load() == Client::kIsAnswered) return false;
      idle->hang_up();
    }
    try {
      client->thread = std::jthread([this, one = client.get()] { serve(*one); });
    } catch (const std::system_error&) {  // No thread could be created.
      return ++dropped_, false;
    }
    clients_.push_back(std::move(client));
    return true;
  }

  void serve(Client& client) {
    bool is_closed = false;
    for (std::size_t left = kMaxRequests; left > 0 && !is_closed; --left) {
      RequestStream stream(client.socket.get());
      client.asks_since = Clock::now();
      if (left < kMaxRequests && !wait_for(client.socket.get(), POLLIN, Clock::now() + kTimeToAskAgain))
        break;
      if (!answer(stream, left == 1, is_closed, [&](auto&) { client.asks_since = Client::kIsAnswered; }))
        break;
    }
    const std::lock_guard lock(mutex_);
    client.socket = FileDescriptor();
    client.asks_since = Clock::now();
    client.is_over = client.is_gone = true;
    client_left_.notify_one();
  }

  /// Newer versions of httplib require the addresses, too.
  template <typename Stream>
  bool answer(Stream& stream, bool is_last, bool& is_closed,
              const std::function<void(httplib::Request&)>& asked) {
    if constexpr (requires { this->process_request(stream, is_last, is_closed, asked); })
      return this->process_request(stream, is_last, is_closed, asked);
    else
      return this->process_request(stream, "", 0, "", 0, is_last, is_closed, asked);
  }

  const std::ptrdiff_t most_ = most_clients();
  std::atomic<std::int64_t>& dropped_;
  mutable std::mutex mutex_;
  std::condition_variable client_left_;
  std::list<std::unique_ptr<Client>> clients_;
};

/// Compares texts in a time that does not depend on where they differ.
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
      server_.listen_after_bind();
      ended_ = true;
    });
  }

  /// Lets answers in progress be sent for a while, which httplib would cut off.
  ~TokenServer() override {
    const auto wait_while = [](const auto& lasts) {
      while (lasts()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    wait_while([this] { return !server_.is_running() && !ended_; });
    end_ = Clock::now() + kTimeToEnd;
    wait_while([this] { return server_.answers() && Clock::now() < end_.load(); });
    server_.stop();
    thread_.join();
    server_.hang_up();
  }

 private:
  void set_up() {
    server_.set_tcp_nodelay(true);
    server_.set_keep_alive_timeout(kTimeToAskAgain.count());
    server_.set_keep_alive_max_count(kMaxRequests);
    // httplib's default would allow two programs to listen at the same port.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server_.set_default_headers({{"Cache-Control", "no-store"},
                                 {"Content-Security-Policy", "frame-ancestors 'none'"},
                                 {"Cross-Origin-Resource-Policy", "same-origin"},
                                 {"Referrer-Policy", "no-referrer"},
                                 {"X-Content-Type-Options", "nosniff"}});
    // Done before httplib reads a body, because it would wait for the body of a POST without a length.
    server_.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      // httplib would send partial answers as if they were complete.
      const_cast<httplib::Request&>(request).ranges.clear();
      send(reply_to(request), response);
      return httplib::Server::HandlerResponse::Handled;
    });
    server_.set_error_handler([this](const httplib::Request&, httplib::Response& response) {
      for (const int refused : {400, 403, 413, 414}) dropped += response.status == refused;
    });
  }

  void listen_at(const std::string& host, int wanted_port) {
    errno = 0;
    port = wanted_port != 0 ? wanted_port : server_.bind_to_any_port(host);
    if (wanted_port != 0 ? server_.bind_to_port(host, port) : port > 0) return server_.let_many_wait();
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

  void send(HttpReply reply, httplib::Response& response) {
    response.status = reply.status;
    // Providers are not called any more.
    if (is_ending()) return response.set_content(reply.body, reply.type);
    if (reply.chunks) {
      response.set_chunked_content_provider(
          reply.type, [this, chunks = std::move(reply.chunks)](std::size_t, httplib::DataSink& sink) {
            const std::optional<std::string> chunk = chunks();
            if (!chunk || is_ending()) return sink.done(), true;
            return chunk->empty() ? sink.is_writable() : write(*chunk, sink, Clock::now() + kTimeToTake);
          });
      return;
    }
    // set_content() would copy and compress.
    const auto body = std::make_shared<const std::string>(std::move(reply.body));
    response.set_content_provider(body->size(), reply.type,
                                  [this, body, until = Clock::now() + kTimeOfAnswer](
                                      std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                                    return write(std::string_view(*body).substr(offset, length), sink, until);
                                  });
  }

  /// Sends bytes to a client. httplib drops clients that accept nothing for a while; this also drops those
  /// that accept too little.
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
  std::atomic<Clock::time_point> end_{Clock::time_point::max()};
  Server server_{dropped};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<HttpServer> listen_http(const std::string& host, int port, const std::string& token,
                                        std::map<std::string, HttpHandler> handlers) {
  const auto on_broken_pipe = std::signal(SIGPIPE, SIG_DFL);  // Restores the handler that httplib changes.
  auto server = std::make_unique<TokenServer>(host, port, token, std::move(handlers));
  std::signal(SIGPIPE, on_broken_pipe);
  return server;
}

}  // namespace gelslam::exchange::detail
