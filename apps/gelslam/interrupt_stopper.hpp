#pragma once

#include <chrono>
#include <thread>

#include "gelslam/core/interrupt.hpp"
#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// A camera may keep next() waiting for seconds; Ctrl-C must not wait with it.
class InterruptStopper {
 public:
  explicit InterruptStopper(RawFrameSource& source)
      : thread_([this, &source](const std::stop_token& done) {
          while (!done.stop_requested()) {
            if (interrupt_.requested()) {
              source.stop();
              return;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
          }
        }) {}
  bool requested() const { return interrupt_.requested(); }

 private:
  InterruptWatch interrupt_;
  std::jthread thread_;
};

}  // namespace gelslam
