#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace gelslam {

/// Lines of text to any number of readers, from a thread of its own: write() never waits. Each reader has a
/// queue of 256 lines. A reader that is slower loses the oldest and is told how many; one that is gone is
/// forgotten, and may connect again.
class StreamServer {
 public:
  /// `target`: "-" (standard output), "unix:PATH" (a socket that is made there) or "tcp:PORT" (0: any free
  /// one), for programs on this machine. `dropped_notice`: the line that tells a reader how many lines it
  /// lost. Throws Error when the target is none of these, is in use, or cannot be opened.
  StreamServer(const std::string& target, std::function<std::string(std::int64_t lines)> dropped_notice);
  ~StreamServer();

  /// Nothing is sent afterwards; readers get up to a second for what is still queued. False when standard
  /// output could not be written, as on a full disk. A reader that left is no failure.
  bool finish();

  /// Thread-safe. `line` with its line end.
  void write(std::string line);
  /// Also kept for readers that connect later: they get the kept lines first, by `key`. A line replaces
  /// that of the same key.
  void write_and_keep(int key, std::string line);
  void forget_kept();

  /// Where readers connect: "tcp:127.0.0.1:5555", "unix:/tmp/pose", "-".
  const std::string& name() const;
  int reader_count() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
