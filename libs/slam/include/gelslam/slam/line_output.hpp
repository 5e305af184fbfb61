#pragma once

#include <atomic>
#include <thread>

#include "gelslam/slam/line_feed.hpp"

namespace gelslam {

/// Lines of a feed to standard output, on a thread of its own.
class LineOutput {
 public:
  LineOutput(LineFeed& feed, const LineWishes& wishes);
  ~LineOutput() { finish(); }

  /// Closes the feed; its reader gets up to a second for what is still queued. False when it could not be
  /// written, as on a full disk. A reader that left is no failure.
  bool finish();

 private:
  void run(LineFeed::Reader& lines);
  bool write(const std::string& lines);

  LineFeed& feed_;
  std::atomic<bool> ending_{false}, failed_{false};
  std::chrono::steady_clock::time_point end_at_{};
  std::jthread thread_;
};

}  // namespace gelslam
