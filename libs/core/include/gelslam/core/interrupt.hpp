#pragma once

#include <csignal>

namespace gelslam {

/// Ctrl-C (SIGINT) and SIGTERM ask instead of kill while an instance lives: requested() turns true, long work
/// stops at the next frame and keeps what it has. A second one ends the program at once, as it would without
/// us. One instance at a time; the constructor forgets earlier requests.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

  bool requested() const;

 private:
  struct sigaction previous_interrupt_ {};
  struct sigaction previous_terminate_ {};
};

}  // namespace gelslam
