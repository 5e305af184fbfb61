#pragma once

#include <cstdint>
#include <string>

#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::detail {

inline constexpr std::uint64_t kMatroskaTickNs = 1000;
inline constexpr const char* kLogApplication = "gelslam";
inline constexpr const char* kConfigAttachment = "config.yaml";
inline constexpr const char* kModelAttachment = "nnmodel.pth";
inline constexpr const char* kSensorTag = "SENSOR";
inline constexpr const char* kSettingsTag = "CAMERA_SETTINGS";
inline constexpr const char* kStartTag = "START_UNIX_US";
inline constexpr const char* kFramesTag = "NUMBER_OF_FRAMES";
inline constexpr std::size_t kLargestConfigBytes = 1u << 20;
inline constexpr std::size_t kLargestModelBytes = 4u << 20;
inline constexpr std::size_t kLargestTextBytes = 64u << 10;

/// Kind of the images.
struct MatroskaTrack {
  FrameEncoding encoding = FrameEncoding::jpeg;  ///< not bgr
  int width_px = 0, height_px = 0;
  double rate_hz = 25;
};

/// Everything before the first frame, with the positions of the fields that are filled in when the log is
/// closed.
struct MatroskaHeader {
  std::string bytes;
  std::size_t segment_length_at = 0;  ///< eight bytes
  std::size_t segment_begins_at = 0;
  std::size_t duration_at = 0;  ///< Position of reserved space with the size of duration_element().
  std::size_t frames_at = 0;    ///< Position of reserved space with the size of frames_element().
};

/// `now_unix_us` is the time at which the file is created. `start_unix_us` is the Unix time of time 0; 0: not
/// known.
MatroskaHeader matroska_header(const LogAttachments& stored, const MatroskaTrack& track,
                               std::int64_t now_unix_us, std::int64_t start_unix_us);
std::string duration_element(std::uint64_t ticks);
std::string frames_element(std::int64_t frames);

/// Returns the bytes that precede a frame's `data_bytes` to make a cluster of its own of it, which readers
/// find without an index.
std::string cluster_head(std::uint64_t ticks, std::uint64_t sequence, std::size_t data_bytes);

/// Returns the length of an element in eight bytes, to be written once it is known.
std::string ebml_length_8(std::uint64_t payload_bytes);

}  // namespace gelslam::detail
