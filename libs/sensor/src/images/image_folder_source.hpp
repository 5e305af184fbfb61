#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "gelslam/sensor/frame_source.hpp"

namespace gelslam::detail {

/// True for the endings of image files that are read as frames, whatever their case.
bool has_image_ending(const std::filesystem::path& path);

/// The folder's images in natural order of their names; empty when it holds none. background.png is not a
/// frame.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Images as frames at the profile's rate. `images` must not be empty.
std::unique_ptr<FrameSource> open_image_folder(const std::filesystem::path& folder,
                                               std::vector<std::filesystem::path> images,
                                               const SensorProfile& profile);

}  // namespace gelslam::detail
