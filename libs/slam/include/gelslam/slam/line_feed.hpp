#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

/// A frame as other programs read it.
struct StreamedFrame {
  std::string ndjson, tum;  ///< lines with their ends; `tum` is "" for a frame without a pose
  std::int64_t frame = 0;
  double time_s = 0;
  std::int64_t unix_us = 0;  ///< TactileImage::unix_us
  int scan = 0;
  cv::Mat3b picture{};  ///< what the sensor saw; shared, not copied
  // By the feed.
  std::uint64_t number = 0;
  std::shared_future<std::string> image_line{};  ///< made once, by the first reader that wants it
};

/// What a reader wants of each frame. Surface and images come as NDJSON only.
struct StreamOptions {
  bool tum = false, surface = false, images = false;
};

/// Lines to any number of readers, each at its own pace: write() never waits. A reader has a queue of 256
/// frames; one that is slower loses the oldest, and is told how many. All functions are thread-safe.
class LineFeed {
 public:
  class Reader;

  /// From the next frame on. With `surface`, first all keyframes of the map. The feed has to outlive it.
  std::shared_ptr<Reader> open(const StreamOptions& options);
  bool has_readers() const;

  void write(StreamedFrame frame);
  void set_map(std::shared_ptr<const MapSnapshot> map, int scan);
  /// Readers get what is queued, then they end.
  void close();

 private:
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
  std::string lines_of(const StreamedFrame& frame);
  std::string lines_of_map();

  LineFeed& feed_;
  const StreamOptions options_;
  BoundedQueue<std::shared_ptr<const StreamedFrame>> queue_;  // null: the map has changed
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
