#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/slam/frame_report.hpp"

namespace gelslam {

/// What a reader wants of each frame. Surface and images come as NDJSON only.
struct StreamOptions {
  bool tum = false, surface = false, images = false;
};

/// Frames as lines for other programs (docs/streaming.md), to any number of readers, each at its own pace:
/// write() never waits. A reader has a queue of 256 frames; one that is slower loses the oldest, and is told
/// how many. All functions are thread-safe.
class LineFeed {
 public:
  class Reader;

  /// From the next frame on. With `surface`, first all keyframes of the map. The feed has to outlive it.
  std::shared_ptr<Reader> open(const StreamOptions& options);
  bool has_readers() const;

  /// Every frame, in order. A line of `tum` has a pose in the frame of the first contact, or of a Localizer's
  /// map.
  void write(const FrameReport& report);
  void set_map(std::shared_ptr<const MapSnapshot> map);  ///< the map has changed
  /// Frames and maps that follow belong to another scan.
  void start_scan();
  /// Readers get what is queued, then they end.
  void close();

 private:
  struct Lines {
    std::string ndjson, tum;                // with their ends; `tum` is "" without a pose
    std::shared_future<std::string> image;  // made once, by the first reader that wants it
    std::uint64_t number;
  };

  mutable std::mutex mutex_;
  std::set<Reader*> readers_;
  std::uint64_t written_ = 0;
  std::shared_ptr<const MapSnapshot> map_;  // null: none
  int scan_ = 0;
  bool closed_ = false;
};

/// One reader's lines. Not thread-safe.
class LineFeed::Reader {
 public:
  Reader(LineFeed& feed, const StreamOptions& options);
  ~Reader();
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// The next lines; "" when there is none until `until`; nothing at the end.
  std::optional<std::string> next(std::chrono::steady_clock::time_point until);

 private:
  friend class LineFeed;
  std::string lines_of(const Lines& frame);
  std::string lines_of_map();

  LineFeed& feed_;
  const StreamOptions options_;
  BoundedQueue<std::shared_ptr<const Lines>> queue_;  // null: the map has changed
  std::uint64_t next_number_;
  int newest_keyframe_ = -1;                 // that was sent of this scan; they come in order
  std::shared_ptr<const MapSnapshot> sent_;  // the last map
  int scan_ = 0;
};

/// Lines of a feed to standard output, on a thread of its own.
class LineOutput {
 public:
  LineOutput(LineFeed& feed, const StreamOptions& options);
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
