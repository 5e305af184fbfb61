#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::detail {

/// A video or a single image in any format that libav reads. It limits what a header may claim, and continues
/// with the next image after damage. JPEG, PNG and YUYV images are delivered unchanged, others are decoded.
class VideoFile {
 public:
  /// `format` is libav's name of the only format to accept, or null for any. `track` selects one of several
  /// videos, from 1 (0: the first). Throws Error when the file cannot be read, when its images are larger
  /// than those of any tactile sensor, or when it is a log of two sensors, as older versions wrote.
  explicit VideoFile(const std::filesystem::path& path, const char* format = nullptr, int track = 0);
  ~VideoFile();

  struct Properties {
    FrameEncoding encoding = FrameEncoding::bgr;  ///< bgr: decoded by this class.
    int width_px = 0, height_px = 0;
    double rate_hz = 0;                  ///< 0: not specified.
    double duration_s = 0;               ///< 0: not specified.
    std::optional<std::int64_t> frames;  ///< According to the header, or to duration and rate.
    bool frames_are_counted = false;     ///< True if the header specifies it.
    int tracks = 0;                      ///< Number of videos in the file.
    bool ours = false;                   ///< True if written by LogWriter.
    std::int64_t start_unix_us = 0;      ///< Unix time of the video's time 0; 0: not specified.
  };
  const Properties& properties() const { return properties_; }

  struct Packet {
    RawFrame frame;  ///< Only encoding, bytes, size and damage are set.
    std::optional<std::int64_t> time_us{};
    std::optional<std::int64_t> sequence{};
  };
  /// Returns the next image, or why it cannot be decoded; nothing at the end of the readable part.
  std::optional<Packet> next();
  /// Throws Error for an attachment that is too large.
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
