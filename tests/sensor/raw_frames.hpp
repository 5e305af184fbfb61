#pragma once

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

#include "../support/pictures.hpp"
#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam::test {

inline RawFrame raw_frame(FrameEncoding encoding, std::vector<std::uint8_t> bytes, int width, int height,
                          std::int64_t index) {
  RawFrame frame;
  frame.encoding = encoding;
  frame.bytes = std::move(bytes);
  frame.width_px = width;
  frame.height_px = height;
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
  return raw_frame(FrameEncoding::jpeg, std::move(bytes), width, height, index);
}

inline RawFrame bgr_frame(const cv::Mat3b& picture, std::int64_t index) {
  return raw_frame(FrameEncoding::bgr, {picture.datastart, picture.datastart + picture.total() * 3},
                   picture.cols, picture.rows, index);
}

}  // namespace gelslam::test
