#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::detail {

/// A video or a single picture of any format that libav reads, which bounds what a header may claim and finds
/// the next picture after damage. JPEG, PNG and YUYV pictures are handed on as they are, others decoded.
class VideoFile {
 public:
  /// `format`: libav's name of the only format to take, or null for any. `track`: which of several videos,
  /// from 1 (0: the first). Throws Error when the file cannot be read, its pictures are larger than any touch
  /// sensor's, or it is a log of two sensors, as older versions made.
  explicit VideoFile(const std::filesystem::path& path, const char* format = nullptr, int track = 0);
  ~VideoFile();

  struct Properties {
    FrameEncoding encoding = FrameEncoding::bgr;  ///< bgr: decoded here
    int width_px = 0, height_px = 0;
    double rate_hz = 0;                  ///< 0: not said
    double duration_s = 0;               ///< 0: not said
    std::optional<std::int64_t> frames;  ///< as the header says it, or by duration and rate
    bool frames_are_counted = false;     ///< the header says it
    int tracks = 0;                      ///< videos in the file
    bool ours = false;                   ///< written by LogWriter
    std::int64_t start_unix_us = 0;      ///< when its time 0 was; 0: not said
  };
  const Properties& properties() const { return properties_; }

  struct Packet {
    RawFrame frame;  ///< encoding, bytes, size, damage
    std::optional<std::int64_t> time_us{};
    std::optional<std::int64_t> sequence{};
  };
  /// The next picture, or why it cannot be decoded; nothing at the end of what is readable.
  std::optional<Packet> next();
  /// Throws Error on one that is too large.
  LogAttachments attachments() const;

 private:
  struct Av;
  void find_video(bool is_matroska, int track);
  std::optional<Packet> next_as_it_is();
  std::optional<Packet> next_decoded();

  std::filesystem::path path_;
  std::unique_ptr<Av> av_;
  Properties properties_;
};

}  // namespace gelslam::detail
