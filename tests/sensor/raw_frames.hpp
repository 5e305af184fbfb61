#pragma once

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

#include "../support/pictures.hpp"
#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::test {

inline RawFrame raw_frame(FrameEncoding encoding, std::vector<std::uint8_t> bytes, const cv::Size& size,
                          std::int64_t index = 0) {
  RawFrame frame;
  frame.encoding = encoding;
  frame.bytes = std::move(bytes);
  frame.width_px = size.width;
  frame.height_px = size.height;
  frame.index = frame.sequence = index;
  frame.time_s = 0.04 * static_cast<double>(index);
  return frame;
}

/// A JPEG as a camera sends it (numbered_picture), with a few bytes after its end that differ from frame to
/// frame.
inline RawFrame jpeg_frame(std::int64_t index, int width = 64, int height = 48) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", numbered_picture(static_cast<int>(index % 16), width, height), bytes,
               {cv::IMWRITE_JPEG_QUALITY, 95});
  std::minstd_rand random(static_cast<std::uint32_t>(index + 1));
  for (auto i = random() % 7; i > 0; --i) bytes.push_back(static_cast<std::uint8_t>(random()));
  return raw_frame(FrameEncoding::jpeg, std::move(bytes), {width, height}, index);
}

inline RawFrame bgr_frame(const cv::Mat3b& picture, std::int64_t index = 0) {
  return raw_frame(FrameEncoding::bgr, {picture.datastart, picture.datastart + picture.total() * 3},
                   picture.size(), index);
}

inline std::vector<RawFrame> read_all(RawFrameSource& source) {
  std::vector<RawFrame> frames;
  while (std::optional<RawFrame> frame = source.next()) frames.push_back(std::move(*frame));
  return frames;
}

/// Of a GelSight Mini whose camera gives pictures of this size.
inline SensorProfile mini_of(const cv::Size& raw) {
  SensorProfile profile;
  profile.raw_width_px = raw.width;
  profile.raw_height_px = raw.height;
  return profile;
}

}  // namespace gelslam::test
