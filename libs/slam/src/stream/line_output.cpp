#include "gelslam/slam/line_output.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>

namespace gelslam {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kTimeToFinish = std::chrono::seconds(1);
constexpr int kLookAgainMs = 50;

}  // namespace

LineOutput::LineOutput(LineFeed& feed, const LineWishes& wishes)
    : feed_(feed), thread_([this, reader = feed.open(wishes)] { run(*reader); }) {}

void LineOutput::run(LineFeed::Reader& lines) {
  sigset_t broken_pipe;  // a reader that is gone is no reason to end the program
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
  while (const auto text = lines.next(Clock::now() + std::chrono::seconds(1)))
    if (!write(*text)) return;
}

/// False when nobody reads any more, or the end does not wait longer.
bool LineOutput::write(const std::string& lines) {
  for (std::size_t done = 0; done < lines.size();) {
    pollfd out{STDOUT_FILENO, POLLOUT, 0};
    ::poll(&out, 1, kLookAgainMs);
    if (ending_ && Clock::now() > end_at_) return false;
    if ((out.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return false;
    if ((out.revents & POLLOUT) == 0) continue;
    // What a ready pipe takes at once.
    const ssize_t count =
        ::write(STDOUT_FILENO, lines.data() + done, std::min<std::size_t>(lines.size() - done, PIPE_BUF));
    if (count < 0 && errno != EAGAIN && errno != EINTR) {
      failed_ = errno != EPIPE;
      return false;
    }
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return true;
}

bool LineOutput::finish() {
  if (thread_.joinable()) {
    end_at_ = Clock::now() + kTimeToFinish;
    ending_ = true;
    feed_.close();
    thread_.join();
  }
  return !failed_;
}

}  // namespace gelslam
