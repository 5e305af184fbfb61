#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/simulation/sensor_geometry.hpp"

namespace gelslam::simulation::detail {

/// Throws Error.
void make_folder(const std::filesystem::path& folder);

/// A picture as it is kept in gelsight.avi: JPEG of full color resolution, or PNG.
std::vector<std::uint8_t> encode_frame(const cv::Mat3b& bgr, bool lossless);

/// config.yaml of a data folder, with the same keys as the public configurations have. `model`: empty, or the
/// nnmodel.pth to name.
std::string config_yaml(const std::filesystem::path& folder, const SensorGeometry& geometry,
                        double frame_rate_hz, const std::filesystem::path& model);

}  // namespace gelslam::simulation::detail
