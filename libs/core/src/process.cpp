#include "gelslam/core/process.hpp"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <fstream>

namespace gelslam {
namespace {

// A signal handler can only access globals. They are lock-free, so that it may set them and any thread may
// read them.
std::atomic<int> request_count{0};  // Number of requests so far.
std::atomic<int> request_limit{0};  // Number of requests that do not end the program; 0: there is no watch.
std::atomic<int> request_start{0};  // Number of requests before the outermost watch.
std::atomic<int> first_signal{0};
std::atomic<bool> ends_regularly{false};
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void on_interrupt(int signal) {
  // A shell forwards the hang-up that the terminal has already sent, so that a closed terminal would count
  // twice.
  if (signal == SIGHUP && request_count.load() > request_start.load()) return;
  int none = 0;
  if (!ends_regularly.load()) first_signal.compare_exchange_strong(none, signal);
  if (request_count.fetch_add(1) + 1 < request_limit.load()) return;
  // The next signal ends the program immediately.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

}  // namespace

double resident_memory_mb() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0, resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0.0;
  return resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

void return_free_memory() {
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

void lower_thread_priority() {
  constexpr int kSteps = 10,
                // Ten steps correspond to about a tenth of the processor time compared with the caller.
      kLowest = 19;
  // On Linux a nice value belongs to a thread, and 0 stands for the calling one.
  errno = 0;
  const int now = ::getpriority(PRIO_PROCESS, 0);  // -1 is also a valid value.
  if (errno == 0) ::setpriority(PRIO_PROCESS, 0, std::min(now + kSteps, kLowest));
}

InterruptWatch::InterruptWatch(int asks, Ends ends)
    : first_request_(request_count.load()),
      previous_ends_regularly_(ends_regularly.load()),
      previous_limit_(request_limit.load()) {
  if (previous_limit_ == 0) {
    first_signal.store(0);
    request_start.store(first_request_);
  }
  ends_regularly.store(ends == Ends::regularly);
  request_limit.store(first_request_ + asks);
  struct sigaction action {};
  action.sa_handler = ends == Ends::at_once ? SIG_DFL : on_interrupt;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &previous_interrupt_);
  sigaction(SIGTERM, &action, &previous_terminate_);
  sigaction(SIGHUP, nullptr, &previous_hangup_);
  // Not done under nohup, where the program must outlive the terminal.
  if (previous_hangup_.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

InterruptWatch::~InterruptWatch() {
  ends_regularly.store(previous_ends_regularly_);
  request_limit.store(previous_limit_);
  sigaction(SIGINT, &previous_interrupt_, nullptr);
  sigaction(SIGTERM, &previous_terminate_, nullptr);
  sigaction(SIGHUP, &previous_hangup_, nullptr);
}

int InterruptWatch::requests() const { return request_count.load() - first_request_; }

int InterruptWatch::ended_early_by() { return first_signal.load(); }

}  // namespace gelslam
