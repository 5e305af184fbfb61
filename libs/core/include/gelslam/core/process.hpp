#pragma once

#include <csignal>

namespace gelslam {

/// Returns the memory of this process that is in RAM, in MB (2^20 bytes); 0 if the system does not tell.
double resident_memory_mb();

/// Returns freed memory to the system that the allocator would otherwise keep: memory freed by threads, and
/// memory below blocks that are still in use. To be called after much memory was freed.
void return_free_memory();

/// Lowers the priority of the calling thread by ten nice steps relative to its current one, so that the order
/// within the program is kept under `nice`, too. For work that must never delay the tracker. Threads that it
/// starts afterwards inherit the priority. To be called once per thread. Has no effect if the system refuses.
void lower_thread_priority();

/// While an instance exists, the first `asks` signals Ctrl-C (SIGINT) or SIGTERM do not end the program.
/// Instead requested() becomes true, and long work stops at the next frame and keeps its results. The next
/// signal (by default the second) ends the program immediately. A closed terminal (SIGHUP) also counts as a
/// request, but only once. A nested instance counts its own requests; the outer one counts them, too.
class InterruptWatch {
 public:
  /// regularly: a signal is the normal way to end the work, as with a camera. at_once: even the first signal
  /// ends the program, within another instance, too; for work of a library that cannot be stopped and has
  /// written nothing.
  enum class Ends { early, regularly, at_once };
  explicit InterruptWatch(int asks = 1, Ends ends = Ends::early);
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  bool requested() const { return requests() > 0; }
  int requests() const;
  /// Returns the first signal that ended work early since the latest outermost instance was created, even
  /// after its destruction; 0 if there was none.
  static int ended_early_by();

 private:
  const int first_request_;
  // Of the enclosing instance; for example, a camera is opened within the work that uses it.
  const bool previous_ends_regularly_;
  const int previous_limit_;
  struct sigaction previous_interrupt_ {};
  struct sigaction previous_terminate_ {};
  struct sigaction previous_hangup_ {};
};

}  // namespace gelslam
