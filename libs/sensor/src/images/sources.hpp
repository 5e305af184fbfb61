#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam::detail {

/// True for the endings of image files that are read as frames, whatever their case.
bool has_image_ending(const std::filesystem::path& path);

/// The folder's images in natural order of their names; empty when it holds none. background.png is not a
/// frame.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Images as frames at the profile's rate. `images` must not be empty.
std::unique_ptr<RawFrameSource> open_image_folder(const std::filesystem::path& folder,
                                                  std::vector<std::filesystem::path> images,
                                                  const SensorProfile& profile);

/// An image file: JPEG and PNG as they are, BMP decoded. Throws Error when it is none of these.
RawFrame read_image_file(const std::filesystem::path& path);

/// Makes `bgr` the frame's picture; its times and counts stay.
inline void put_picture(const cv::Mat3b& bgr, RawFrame& frame) {
  const cv::Mat3b rows = bgr.isContinuous() ? bgr : bgr.clone();
  frame.encoding = FrameEncoding::bgr;
  frame.bytes.assign(rows.ptr(), rows.ptr() + rows.total() * rows.elemSize());
  frame.width_px = rows.cols;
  frame.height_px = rows.rows;
}

}  // namespace gelslam::detail
