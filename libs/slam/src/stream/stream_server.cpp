#include "gelslam/slam/stream_server.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <deque>
#include <list>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "stream/stream_socket.hpp"

namespace gelslam {

namespace slam::detail {

constexpr std::size_t kQueuedLines = 256;  // ten seconds of frames
constexpr std::size_t kMaxReaders = 64;
constexpr auto kTimeToFinish = std::chrono::seconds(1);
constexpr auto kNoDescriptor = std::chrono::milliseconds(100);  // until a reader is accepted after EMFILE

using Line = std::shared_ptr<const std::string>;

struct StreamReader {
  FileDescriptor socket;  // none: standard output
  // Of the server's thread.
  Line sending;
  std::size_t sent = 0;
  bool listens_only = false;  // it has closed its side for sending
  bool gone = false, failed = false;
  // Under the lock.
  std::deque<Line> queue;
  std::size_t most_queued = kQueuedLines;
  std::int64_t dropped = 0;

  int fd() const { return socket.get() < 0 ? STDOUT_FILENO : socket.get(); }

  void push(const Line& line) {
    queue.push_back(line);
    if (queue.size() <= most_queued) return;
    queue.pop_front();
    ++dropped;
  }

  /// As much as can be sent without waiting.
  ssize_t send(const char* bytes, std::size_t count) {
    if (socket.get() >= 0) return ::send(fd(), bytes, count, MSG_DONTWAIT | MSG_NOSIGNAL);
    return ::write(fd(), bytes, std::min<std::size_t>(count, PIPE_BUF));  // what a ready pipe takes at once
  }

  void send_on() {
    const ssize_t count = send(sending->data() + sent, sending->size() - sent);
    if (count < 0) {
      gone = errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR;
      failed = gone && errno != EPIPE && socket.get() < 0;
      return;
    }
    sent += static_cast<std::size_t>(count);
    if (sent < sending->size()) return;
    sending.reset();
    sent = 0;
  }

  /// What readers say is not listened to, only that they end.
  void detect_close() {
    char ignored[256];
    const ssize_t count = ::recv(fd(), ignored, sizeof ignored, MSG_DONTWAIT);
    if (count == 0) listens_only = true;
    if (count < 0 && errno != EAGAIN && errno != EINTR) gone = true;
  }
};

}  // namespace slam::detail

using namespace slam::detail;

struct StreamServer::Impl {
  using Clock = std::chrono::steady_clock;

  explicit Impl(std::function<std::string(std::int64_t)> dropped_notice)
      : notice(std::move(dropped_notice)) {}

  void serve();
  bool has_finished();
  void wait_for_work();
  void accept_reader();
  bool next_line(StreamReader& reader);
  void wake() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake_up.get(), &one, sizeof one);
  }

  const std::function<std::string(std::int64_t)> notice;
  Listener listener;
  FileDescriptor wake_up{::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
  std::atomic<bool> ending{false}, output_failed{false};
  Clock::time_point listen_at{};    // of the server's thread: readers are accepted from then on
  mutable std::mutex mutex;         // for what follows
  std::list<StreamReader> readers;  // the server's thread alone adds and removes
  std::map<int, Line> kept;         // by key
  Clock::time_point end_at{};
  std::jthread thread;
};

void StreamServer::Impl::accept_reader() {
  FileDescriptor socket(::accept4(listener.socket.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (socket.get() < 0) {
    if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) listen_at = Clock::now() + kNoDescriptor;
    return;
  }
  const int yes = 1;
  ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  const std::lock_guard lock(mutex);
  if (readers.size() >= kMaxReaders) return;
  StreamReader& reader = readers.emplace_back();
  reader.socket = std::move(socket);
  for (const auto& [key, line] : kept) reader.queue.push_back(line);
  reader.most_queued += kept.size();
}

/// Takes the reader's next line out of its queue; false when there is none.
bool StreamServer::Impl::next_line(StreamReader& reader) {
  if (reader.sending) return true;
  const std::lock_guard lock(mutex);
  if (reader.dropped > 0) {
    reader.sending = std::make_shared<const std::string>(notice(std::exchange(reader.dropped, 0)));
  } else if (!reader.queue.empty()) {
    reader.sending = std::move(reader.queue.front());
    reader.queue.pop_front();
  }
  return reader.sending != nullptr;
}

void StreamServer::Impl::wait_for_work() {
  constexpr int kLookAgainMs = 50;
  const bool listens = Clock::now() >= listen_at;
  std::vector<pollfd> files = {{wake_up.get(), POLLIN, 0}, {listens ? listener.socket.get() : -1, POLLIN, 0}};
  for (StreamReader& reader : readers)
    files.push_back({reader.fd(),
                     static_cast<short>((next_line(reader) ? POLLOUT : 0) |
                                        (reader.socket.get() < 0 || reader.listens_only ? 0 : POLLIN)),
                     0});
  ::poll(files.data(), files.size(), ending || !listens ? kLookAgainMs : -1);
  std::uint64_t woken = 0;
  [[maybe_unused]] const ssize_t read = ::read(wake_up.get(), &woken, sizeof woken);
  std::size_t k = 2;
  for (StreamReader& reader : readers) {
    const short events = files[k++].revents;
    if ((events & (POLLERR | POLLHUP | POLLNVAL)) != 0) reader.gone = true;
    if ((events & POLLIN) != 0) reader.detect_close();
    if ((events & POLLOUT) != 0 && !reader.gone) reader.send_on();
    if (reader.failed) output_failed = true;
  }
  if (files[1].revents != 0) accept_reader();
  const std::lock_guard lock(mutex);
  readers.remove_if([](const StreamReader& reader) { return reader.gone; });
}

bool StreamServer::Impl::has_finished() {
  const std::lock_guard lock(mutex);
  return ending && (Clock::now() > end_at ||
                    std::all_of(readers.begin(), readers.end(), [](const StreamReader& reader) {
                      return reader.queue.empty() && !reader.sending;
                    }));
}

void StreamServer::Impl::serve() {
  sigset_t broken_pipe;  // a reader that is gone is no reason to end the program
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
  while (!has_finished()) wait_for_work();
}

StreamServer::StreamServer(const std::string& target, std::function<std::string(std::int64_t)> dropped_notice)
    : impl_(std::make_unique<Impl>(std::move(dropped_notice))) {
  if (target == "-") {
    impl_->listener.name = target;
    impl_->readers.emplace_back();
  } else {
    impl_->listener = slam::detail::listen_at(target);
  }
  impl_->thread = std::jthread([this] { impl_->serve(); });
}

StreamServer::~StreamServer() {
  finish();
  if (!impl_->listener.unix_path.empty()) ::unlink(impl_->listener.unix_path.c_str());
}

bool StreamServer::finish() {
  if (!impl_->thread.joinable()) return !impl_->output_failed;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
    impl_->end_at = Impl::Clock::now() + kTimeToFinish;
  }
  impl_->wake();
  impl_->thread.join();
  return !impl_->output_failed;
}

void StreamServer::write(std::string line) {
  const auto shared = std::make_shared<const std::string>(std::move(line));
  {
    const std::lock_guard lock(impl_->mutex);
    for (StreamReader& reader : impl_->readers) reader.push(shared);
  }
  impl_->wake();
}

void StreamServer::write_and_keep(int key, std::string line) {
  const auto shared = std::make_shared<const std::string>(std::move(line));
  {
    const std::lock_guard lock(impl_->mutex);
    const bool is_new = impl_->kept.insert_or_assign(key, shared).second;
    for (StreamReader& reader : impl_->readers) {
      if (is_new) ++reader.most_queued;  // as for a reader that connects later
      reader.push(shared);
    }
  }
  impl_->wake();
}

void StreamServer::forget_kept() {
  const std::lock_guard lock(impl_->mutex);
  impl_->kept.clear();
}

const std::string& StreamServer::name() const { return impl_->listener.name; }

int StreamServer::reader_count() const {
  const std::lock_guard lock(impl_->mutex);
  return static_cast<int>(impl_->readers.size());
}

}  // namespace gelslam
