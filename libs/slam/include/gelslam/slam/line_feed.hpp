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

/// What a reader of the stream receives for each frame. Surfaces and images exist in NDJSON only.
struct StreamOptions {
  bool tum = false, surface = false, images = false;
};

/// Sends frames as lines of text to other programs (docs/streaming.md). There may be any number of readers,
/// each with its own speed: write() never waits. Each reader has a queue of 256 frames. A reader that is
/// slower loses the oldest frames and is told how many. All functions are thread-safe.
class LineFeed {
 public:
  class Reader;

  /// Opens a reader, which receives lines from the next frame on. With `surface` it first receives all
  /// keyframes of the map. The feed must outlive the reader.
  std::shared_ptr<Reader> open(const StreamOptions& options);

  /// Sends a frame to all readers. To be called for every frame, in order. A `tum` line contains the pose in
  /// the frame of the first contact, or in the map of a Localizer.
  void write(const FrameReport& report);
  void set_map(std::shared_ptr<const MapSnapshot> map);  ///< the map has changed
  /// Begins a new scan, to which all later frames and maps belong.
  void start_scan();
  /// Ends the stream: each reader receives what is still in its queue, and then the end.
  void close();

 private:
  struct Lines {
    std::string ndjson, tum;                // With line ends; `tum` is "" without a pose.
    std::shared_future<std::string> image;  // Encoded once, by the first reader that needs it.
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

  /// Returns the next lines; "" if there are none until `until`; nothing at the end of the stream.
  std::optional<std::string> next(std::chrono::steady_clock::time_point until);

 private:
  friend class LineFeed;
  std::string lines_of(const Lines& frame);
  std::string lines_of_map();

  LineFeed& feed_;
  const StreamOptions options_;
  BoundedQueue<std::shared_ptr<const Lines>> queue_;  // A null entry means that the map has changed.
  std::uint64_t next_number_;
  int newest_keyframe_ = -1;  // Newest keyframe of this scan that was sent; they are sent in order.
  std::shared_ptr<const MapSnapshot> sent_;  // the last map
  int scan_ = 0;
};

/// Writes the lines of a feed to standard output, on its own thread.
class LineOutput {
 public:
  LineOutput(LineFeed& feed, const StreamOptions& options);
  ~LineOutput() { finish(); }

  /// Closes the feed and gives its reader up to one second to write what is still queued. Returns false if
  /// something could not be written, as on a full disk. A reader that closed its end of the pipe is no
  /// failure.
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
