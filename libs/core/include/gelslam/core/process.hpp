#pragma once

#include <csignal>

namespace gelslam {

/// Memory of this process that is in RAM now, in MB (2^20 bytes); 0 where the system does not tell.
double resident_memory_mb();

/// Gives memory that was freed back to the system, where it does not go back by itself: what threads have
/// freed, and what lies below something that is still in use. To be called where much was freed.
void return_free_memory();

/// Lowers the calling thread's priority by ten nice steps below what it has (so that a program started under
/// `nice` keeps the order among its own threads): for work that must never keep the tracker waiting. Threads
/// it starts afterwards inherit it; call it once per thread. Does nothing where the system refuses.
void lower_thread_priority();

/// While an instance lives, the first `asks` signals Ctrl-C (SIGINT) or SIGTERM do not end the program:
/// requested() turns true, and long work stops at the next frame and keeps its results. The next signal (by
/// default the second) ends the program at once. A closed terminal (SIGHUP) counts as a request, too, once.
/// An instance within another one counts its own requests, and the outer one these, too.
class InterruptWatch {
 public:
  /// regularly: only a signal ends the work, as with a camera. at_once: even the first one ends the program,
  /// in the work of a library that cannot be stopped and has written nothing; within another instance, too.
  enum class Ends { early, regularly, at_once };
  explicit InterruptWatch(int asks = 1, Ends ends = Ends::early);
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  bool requested() const { return requests() > 0; }
  int requests() const;
  /// The first signal that ended work early since the latest outermost instance was made, also after its
  /// end; 0: none.
  static int ended_early_by();

 private:
  const int first_request_;
  // Of the instance around it: a camera is opened within the work with it.
  const bool previous_ends_regularly_;
  const int previous_limit_;
  struct sigaction previous_interrupt_ {};
  struct sigaction previous_terminate_ {};
  struct sigaction previous_hangup_ {};
};

}  // namespace gelslam
