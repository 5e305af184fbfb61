#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam::detail {

/// True for the endings of image files that are read as frames, whatever their case.
bool has_image_ending(const std::filesystem::path& path);

/// The folder's images in natural order of their names; empty when it holds none. background.png is not a
/// frame.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Images as frames: times of their names, else the profile's rate. `images` must not be empty.
std::unique_ptr<RawFrameSource> open_image_folder(const std::filesystem::path& folder,
                                                  std::vector<std::filesystem::path> images,
                                                  const SensorProfile& profile);

/// An image file: JPEG and PNG as they are, BMP decoded; where it is none of these, its `damage` says so.
RawFrame read_image_file(const std::filesystem::path& path);

/// Makes `bgr` the frame's picture; its times and counts stay.
inline void put_picture(const cv::Mat3b& bgr, RawFrame& frame) {
  const cv::Mat3b rows = bgr.isContinuous() ? bgr : bgr.clone();
  frame.encoding = FrameEncoding::bgr;
  frame.bytes.assign(rows.ptr(), rows.ptr() + rows.total() * rows.elemSize());
  frame.width_px = rows.cols;
  frame.height_px = rows.rows;
}

constexpr std::int64_t kMaxPicturePixels = 64'000'000;  // eight times a GelSight Mini's raw image

/// False for what a decoder would take a long time or a lot of memory for: headers may claim any size.
bool fits_any_sensor(std::int64_t width_px, std::int64_t height_px);
/// Throws Error where it is false.
void check_picture_size(const std::filesystem::path& path, std::int64_t width_px, std::int64_t height_px);

/// How a picture of some size becomes one of the profile's.
enum class PictureFit { as_it_is, crop, resize, never };
PictureFit picture_fit(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile);

/// For people: "is 640x400 pixels; GelSight Mini needs 320x240, or ...".
std::string wrong_size_text(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile);

/// The part of a picture that fits the profile that is kept, in whole pixels.
cv::Rect kept_window(cv::Size raw, const SensorProfile& profile);

/// Averages each output pixel over the part of `window` it covers; pixel edges of `image` lie at whole
/// numbers, and the window's edges anywhere between them. Parts outside the image count as its border pixels.
/// The window must be at least as large as the output and overlap the image.
cv::Mat3b area_resample(const cv::Mat3b& image, const cv::Rect2d& window, cv::Size size);

}  // namespace gelslam::detail
