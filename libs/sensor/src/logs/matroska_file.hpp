#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::detail {

/// Reads a Matroska file's packets and attachments through libavformat, which bounds what a header may claim
/// and finds the next cluster after damage. Nothing is decoded.
class MatroskaFile {
 public:
  /// Throws Error when it is no Matroska file, or its header is damaged.
  explicit MatroskaFile(const std::filesystem::path& path);
  ~MatroskaFile();

  struct Video {
    std::optional<FrameEncoding> encoding;  ///< none: not one that RawFrame knows
    int width_px = 0, height_px = 0;
    double rate_hz = 0;                  ///< 0: not said
    std::optional<std::int64_t> frames;  ///< as noted when the file was closed, else by duration and rate
    double duration_s = 0;               ///< 0: not said
    bool ours = false;                   ///< written by LogWriter
  };
  const Video& video() const { return video_; }

  struct Packet {
    std::vector<std::uint8_t> bytes;
    std::optional<std::int64_t> time_us;
    std::optional<std::int64_t> sequence;
  };
  /// The next picture; nothing at the end of what is readable.
  std::optional<Packet> next();
  /// Throws Error on one that is too large.
  LogAttachments attachments() const;

 private:
  struct Av;
  void find_video();
  std::filesystem::path path_;
  std::unique_ptr<Av> av_;
  Video video_;
};

}  // namespace gelslam::detail
