#include "serve/http_server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <poll.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"

namespace gelslam::exchange::detail {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostClients = 160;
constexpr int kMostRequests = 10'000;  // of one connection
constexpr std::size_t kMostRequestBytes = 16'384;
constexpr std::chrono::seconds kTimeOfRequest{5}, kTimeOfAnswer{30}, kTimeOfPiece{5}, kTimeToEnd{5};

/// A client's socket. What it sends and how long it takes are bounded.
class ClientStream final : public httplib::Stream {
 public:
  explicit ClientStream(int socket) : socket_(socket) { serving_ = this; }
  ~ClientStream() override { serving_ = nullptr; }

  /// Of the calling thread.
  static ClientStream& serving() { return *serving_; }

  /// Waits for the first byte; false when none comes.
  bool wait_for_request() {
    bytes_left_ = kMostRequestBytes;
    allow(kTimeOfRequest);
    if (begin_ == end_ && !is_ready(POLLIN)) return false;
    return begin_ < end_ || fill() > 0;
  }
  /// What is sent from now on has this much time.
  void allow(Clock::duration time) { until_ = Clock::now() + time; }
  /// The client, not the program, is the reason for an end.
  bool was_too_much() const { return too_much_; }
  bool is_gone() const {
    char byte = 0;
    const ssize_t count = ::recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
  }

  bool is_readable() const override { return begin_ < end_ || is_ready(POLLIN); }
  bool is_writable() const override { return is_ready(POLLOUT); }
  ssize_t read(char* bytes, std::size_t count) override {
    if (begin_ == end_ && (!is_ready(POLLIN) || fill() <= 0)) return -1;
    count = std::min(count, end_ - begin_);
    std::copy_n(buffer_ + begin_, count, bytes);
    begin_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* bytes, std::size_t count) override {
    return is_ready(POLLOUT) ? ::send(socket_, bytes, count, MSG_DONTWAIT | MSG_NOSIGNAL) : -1;
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_; }

 private:
  bool is_ready(short events) const {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until_ - Clock::now()).count();
    pollfd file{socket_, events, 0};
    const int ready = left > 0 ? ::poll(&file, 1, static_cast<int>(left)) : 0;
    // Who is silent between two requests is no offender.
    too_much_ = too_much_ || (ready == 0 && (events == POLLOUT || bytes_left_ < kMostRequestBytes));
    return ready > 0;
  }
  ssize_t fill() {
    const ssize_t count = ::recv(socket_, buffer_, std::min(sizeof buffer_, bytes_left_), MSG_DONTWAIT);
    too_much_ = too_much_ || bytes_left_ == 0;
    begin_ = 0;
    end_ = static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    bytes_left_ -= end_;
    return count;
  }

  static thread_local ClientStream* serving_;

  const int socket_;
  Clock::time_point until_;
  std::size_t bytes_left_ = 0, begin_ = 0, end_ = 0;
  mutable bool too_much_ = false;
  char buffer_[4096];
};

thread_local ClientStream* ClientStream::serving_ = nullptr;

/// A thread for each client. One client too many is passed to `refused` mode: its work is to be closed.
class ClientThreads final : public httplib::TaskQueue {
 public:
  using Accepted = decltype(std::declval<httplib::TaskQueue&>().enqueue({}));  // newer versions return bool

  static bool refuses() { return refuses_; }

  Accepted enqueue(std::function<void()> work) override {
    const auto run = [this, work] {
      work();
      const std::lock_guard lock(mutex_);
      --busy_;
      ended_.notify_all();
    };
    std::unique_lock lock(mutex_);
    refuses_ = busy_ >= kMostClients;
    ++busy_;
    lock.unlock();
    if (refuses_)
      run();
    else
      std::thread(run).detach();
    return Accepted(true);
  }
  void shutdown() override {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return busy_ == 0; });
  }

 private:
  static thread_local bool refuses_;
  std::mutex mutex_;
  std::condition_variable ended_;
  int busy_ = 0;
};

thread_local bool ClientThreads::refuses_ = false;

std::string random_token() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

/// Takes as long wherever the texts differ.
bool is_equal(const std::string& a, const std::string& b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

void send(HttpReply reply, httplib::Response& response) {
  response.status = reply.status;
  if (reply.pieces) {
    response.set_chunked_content_provider(
        reply.type, [pieces = std::move(reply.pieces)](std::size_t, httplib::DataSink& sink) {
          const std::optional<std::string> piece = pieces();
          if (!piece) return sink.done(), true;
          ClientStream& client = ClientStream::serving();
          if (piece->empty()) return !client.is_gone();
          client.allow(kTimeOfPiece);
          return sink.write(piece->data(), piece->size());
        });
    return;
  }
  // Not set_content(): it copies, and compresses.
  const auto body = std::make_shared<const std::string>(std::move(reply.body));
  response.set_content_provider(body->size(), reply.type,
                                [body](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                                  return sink.write(body->data() + offset, length);
                                });
}

class BoundedServer final : public HttpServer, private httplib::Server {
 public:
  BoundedServer(const std::string& host, int wanted_port, const std::string& wanted_token,
                std::map<std::string, HttpHandler> handlers) {
    token = wanted_token.empty() ? random_token() : wanted_token;
    set_up();
    for (auto& [name, handler] : handlers) add(name, std::move(handler));
    listen_at(host, wanted_port);
    thread_ = std::thread([this] {
      listen_after_bind();
      ended_ = true;
    });
  }

  /// Nobody is heard any more; what is being sent goes on for a while.
  ~BoundedServer() override {
    while (!is_running() && !ended_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    stop();
    std::unique_lock lock(mutex_);
    for (const int how : {SHUT_RD, SHUT_RDWR}) {
      for (const int socket : sockets_) ::shutdown(socket, how);
      closed_.wait_for(lock, kTimeToEnd, [this] { return sockets_.empty(); });
    }
    lock.unlock();
    thread_.join();
  }

 private:
  void set_up() {
    new_task_queue = [] { return new ClientThreads; };
    set_payload_max_length(kMostRequestBytes);
    set_socket_options([](socket_t socket) {  // httplib's own let two programs listen at one port
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    set_default_headers({{"Cache-Control", "no-store"},
                         {"Content-Security-Policy", "frame-ancestors 'none'"},
                         {"Cross-Origin-Resource-Policy", "same-origin"},
                         {"Referrer-Policy", "no-referrer"},
                         {"X-Content-Type-Options", "nosniff"}});
    set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      ClientStream::serving().allow(kTimeOfAnswer);
      const std::string why = reason_to_refuse(request);
      if (why.empty()) return HandlerResponse::Unhandled;
      ++dropped;
      send({.status = 403, .body = why + "\n"}, response);
      return HandlerResponse::Handled;
    });
  }

  void add(const std::string& name, HttpHandler handler) {
    const auto handle = [handler = std::move(handler)](const httplib::Request& request,
                                                       httplib::Response& response) {
      send(handler({request.params.begin(), request.params.end()}), response);
    };
    const std::string path = name.substr(name.find(' ') + 1);
    name.starts_with("GET") ? Get(path, handle) : Post(path, handle);
  }

  void listen_at(const std::string& host, int wanted_port) {
    errno = 0;
    port = wanted_port != 0 ? wanted_port : bind_to_any_port(host);
    if (wanted_port != 0 ? !bind_to_port(host, port) : port <= 0) {
      const std::string name = "port " + std::to_string(wanted_port);
      if (errno == EADDRINUSE) throw Error(name + " is in use by another program; choose another one");
      if (errno == EACCES) throw Error(name + " needs rights of root; choose one from 1024");
      throw Error("--serve: " + host + " is no address of this machine");
    }
    ::listen(svr_sock_, kMostClients);  // more may wait to be accepted than httplib lets
  }

  bool process_and_close_socket(socket_t socket) override {
    const FileDescriptor owner(socket);
    if (ClientThreads::refuses()) {
      ++dropped;
      return false;
    }
    keep(socket, true);
    const int yes = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    ClientStream stream(socket);
    bool goes_on = true;
    for (int count = 1; goes_on && svr_sock_ != INVALID_SOCKET && stream.wait_for_request(); ++count) {
      bool closed = false;
      goes_on = process(stream, count == kMostRequests, closed) && !closed;
    }
    if (stream.was_too_much()) ++dropped;
    keep(socket, false);
    ::shutdown(socket, SHUT_RDWR);
    return true;
  }

  template <typename Client>  // the function takes addresses, too, in newer versions
  bool process(Client& client, bool last, bool& closed) {
    // httplib would wait for the body of a POST that says nothing of one.
    const std::function<void(httplib::Request&)> prepare = [](httplib::Request& request) {
      if (!request.has_header("Content-Length") && !request.has_header("Transfer-Encoding"))
        request.set_header("Content-Length", "0");
    };
    if constexpr (requires { this->process_request(client, last, closed, prepare); })
      return this->process_request(client, last, closed, prepare);
    else
      return this->process_request(client, "", 0, "", 0, last, closed, prepare);
  }

  void keep(int socket, bool is_open) {
    const std::lock_guard lock(mutex_);
    is_open ? void(sockets_.insert(socket)) : void(sockets_.erase(socket));
    closed_.notify_all();
  }

  std::string reason_to_refuse(const httplib::Request& request) const {
    const std::string own = "http://" + request.get_header_value("Host");
    if (request.has_header("Origin") && request.get_header_value("Origin") != own)
      return "pages of other sites may not ask";
    if (!is_equal(request.get_param_value("token"), token))
      return "the token is missing or wrong: open the address that gelslam has printed";
    return "";
  }

  std::mutex mutex_;
  std::condition_variable closed_;
  std::set<int> sockets_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace

bool client_is_gone() { return ClientStream::serving().is_gone(); }

std::unique_ptr<HttpServer> listen_http(const std::string& host, int port, const std::string& token,
                                        std::map<std::string, HttpHandler> handlers) {
  const auto on_broken_pipe = std::signal(SIGPIPE, SIG_DFL);  // httplib changes it
  auto server = std::make_unique<BoundedServer>(host, port, token, std::move(handlers));
  std::signal(SIGPIPE, on_broken_pipe);
  return server;
}

}  // namespace gelslam::exchange::detail
