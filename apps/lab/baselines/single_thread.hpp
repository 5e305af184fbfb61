#pragma once

namespace gelslam::baselines::detail {

/// While it lives, OpenMP on this thread runs every parallel region with one thread, even those that ask for
/// as many as the machine has, as Open3D does: times are compared with methods of one thread, sums come in
/// the same order every time, and RANSAC draws the same numbers.
class SingleThread {
 public:
  SingleThread();
  ~SingleThread();
  SingleThread(const SingleThread&) = delete;
  SingleThread& operator=(const SingleThread&) = delete;

 private:
  int levels_before_;
};

}  // namespace gelslam::baselines::detail
