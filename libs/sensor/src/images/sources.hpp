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

/// Returns the folder's images in natural order of their names; empty if there are none. background.png is
/// not a frame.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Opens images as frames, with the times in their names or else the profile's rate. `images` must not be
/// empty.
std::unique_ptr<RawFrameSource> open_image_folder(const std::filesystem::path& folder,
                                                  std::vector<std::filesystem::path> images,
                                                  const SensorProfile& profile);

/// Reads an image file: JPEG and PNG unchanged, BMP decoded. For anything else, `damage` says what is wrong.
RawFrame read_image_file(const std::filesystem::path& path);

/// Replaces the frame's image by `bgr`; its times and counters are kept.
inline void put_picture(const cv::Mat3b& bgr, RawFrame& frame) {
  const cv::Mat3b rows = bgr.isContinuous() ? bgr : bgr.clone();
  frame.encoding = FrameEncoding::bgr;
  frame.bytes.assign(rows.ptr(), rows.ptr() + rows.total() * rows.elemSize());
  frame.width_px = rows.cols;
  frame.height_px = rows.rows;
}

constexpr std::int64_t kMaxPicturePixels = 64'000'000;  // eight times a GelSight Mini's raw image

/// Returns false for a size that would take a decoder much time or memory, as headers may claim any size.
bool fits_any_sensor(std::int64_t width_px, std::int64_t height_px);
/// Throws Error if fits_any_sensor() is false.
void check_picture_size(const std::filesystem::path& path, std::int64_t width_px, std::int64_t height_px);

/// How an image of some size is converted to the profile's size.
enum class PictureFit { as_it_is, crop, resize, never };
PictureFit picture_fit(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile);

/// Returns a text for the user: "is 640x400 pixels; GelSight Mini needs 320x240, or ...".
std::string wrong_size_text(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile);

/// Returns the part of an image that is kept when it is cropped for the profile, in whole pixels.
cv::Rect kept_window(cv::Size raw, const SensorProfile& profile);

/// Resamples by averaging each output pixel over the part of `window` that it covers. Pixel edges of `image`
/// are at integers; the edges of the window may be anywhere. Parts outside the image have the values of its
/// border pixels. The window must be at least as large as the output and overlap the image.
cv::Mat3b area_resample(const cv::Mat3b& image, const cv::Rect2d& window, cv::Size size);

}  // namespace gelslam::detail
