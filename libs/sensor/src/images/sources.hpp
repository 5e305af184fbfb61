#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam::detail {

/// A video file. Times are the container's where they increase, else index / rate.
std::unique_ptr<FrameSource> open_video(const std::filesystem::path& path, const SensorProfile& profile);

/// True for the endings of image files that are read as frames, whatever their case.
bool has_image_ending(const std::filesystem::path& path);

/// The folder's images in natural order of their names; empty when it holds none. background.png is not a
/// frame.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Images as frames at the profile's rate. `images` must not be empty.
std::unique_ptr<FrameSource> open_image_folder(const std::filesystem::path& folder,
                                               std::vector<std::filesystem::path> images,
                                               const SensorProfile& profile);

/// A Matroska log of ours as a stream of pictures, decoded as a live frame is (FrameDecoder). Damaged
/// pictures are left out and counted in warning(). Null when its pictures are of a kind that RawFrame does
/// not know.
std::unique_ptr<FrameSource> open_matroska_frames(const std::filesystem::path& log,
                                                  const SensorProfile& profile);

/// The same log as raw frames, or null.
std::unique_ptr<RawFrameSource> open_matroska_log(const std::filesystem::path& log,
                                                  const SensorProfile& profile);

/// Makes `bgr` the frame's picture; its times and counts stay.
inline void put_picture(const cv::Mat3b& bgr, RawFrame& frame) {
  const cv::Mat3b rows = bgr.isContinuous() ? bgr : bgr.clone();
  frame.encoding = FrameEncoding::bgr;
  frame.bytes.assign(rows.ptr(), rows.ptr() + rows.total() * rows.elemSize());
  frame.width_px = rows.cols;
  frame.height_px = rows.rows;
}

}  // namespace gelslam::detail
