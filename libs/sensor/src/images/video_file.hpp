#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

struct AVDictionary;
struct AVFormatContext;

namespace gelslam::detail {

/// A video or a single picture of any format that libav decodes.
class VideoFile {
 public:
  /// `format`: libav's name of the only format to take, or null for any. Throws Error when the file cannot be
  /// read, or its pictures are larger than any touch sensor's.
  explicit VideoFile(const std::filesystem::path& path, const char* format = nullptr);
  ~VideoFile();

  struct Properties {
    int width_px = 0, height_px = 0;
    double rate_hz = 0;                  ///< 0: not said
    std::optional<std::int64_t> frames;  ///< as the header says it, or by duration and rate
  };
  const Properties& properties() const { return properties_; }

  struct Frame {
    cv::Mat3b bgr;
    double time_s = 0;  ///< since the container's start
  };
  /// The next picture; nothing at the end, or where the video can be decoded no further.
  std::optional<Frame> next();

 private:
  struct Av;
  void find_properties();
  bool receive();
  double time_of_frame() const;

  std::unique_ptr<Av> av_;
  Properties properties_;
};

/// Opens a file of libav's format `format` (null: of any). Null when it cannot be read; else for
/// avformat_close_input().
AVFormatContext* open_container(const std::filesystem::path& path, const char* format,
                                AVDictionary** options = nullptr);

/// As a whole number; nothing for what no file holds.
std::optional<std::int64_t> plausible_frames(double frames);

}  // namespace gelslam::detail
