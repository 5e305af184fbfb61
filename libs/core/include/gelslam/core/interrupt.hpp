#pragma once

#include <csignal>

namespace gelslam {

/// Ctrl-C (SIGINT) and SIGTERM ask instead of kill while an instance lives: requested() turns true, long work
/// stops at the next frame and keeps what it has. The one after the last that asks (by default the second)
/// ends the program at once, as it would without us. A terminal that is closed (SIGHUP) asks, too, once. One
/// instance at a time; the constructor forgets earlier requests.
class InterruptWatch {
 public:
  explicit InterruptWatch(int asks = 1);
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  bool requested() const { return requests() > 0; }
  int requests() const;

 private:
  struct sigaction previous_interrupt_ {};
  struct sigaction previous_terminate_ {};
  struct sigaction previous_hangup_ {};
};

}  // namespace gelslam
