#pragma once

#include <cstdint>
#include <opencv2/core/types.hpp>
#include <string>

#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam::detail {

constexpr std::int64_t most_picture_pixels = 64'000'000;  // eight times a GelSight Mini's raw image

/// How a picture of some size becomes one of the profile's.
enum class PictureFit { as_it_is, crop, never };
PictureFit picture_fit(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile);

/// For people: "is 640x400 pixels; GelSight Mini needs 320x240, or ...".
std::string residual_text(std::int64_t width_px, std::int64_t height_px, const SensorProfile& profile);

/// The part of a raw picture that crop_and_resize keeps, in whole raw pixels.
cv::Rect crop_window(cv::Size raw, int width_px, int height_px);

}  // namespace gelslam::detail
