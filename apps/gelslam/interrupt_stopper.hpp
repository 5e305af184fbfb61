#pragma once

#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "gelslam/core/interrupt.hpp"

namespace gelslam {

/// Does once what Ctrl-C asks for, whatever the other threads wait for: a camera may keep next() waiting for
/// seconds.
class InterruptStopper {
 public:
  explicit InterruptStopper(std::function<void()> stop)
      : thread_([this, stop = std::move(stop)](const std::stop_token& done) {
          while (!done.stop_requested()) {
            if (interrupt_.requested()) return stop();
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
          }
        }) {}
  bool requested() const { return interrupt_.requested(); }

 private:
  InterruptWatch interrupt_;
  std::jthread thread_;
};

}  // namespace gelslam
