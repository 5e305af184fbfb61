#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam {

/// PNG of a gray or BGR picture with 8 bits per channel. Compressed for speed: 3 ms for 320 x 240 pixels of a
/// gel, 10 % larger than the best. Throws Error.
std::vector<std::uint8_t> encode_png(const cv::Mat& picture);

/// The same as a file, which appears whole. Throws Error.
void write_png(const std::filesystem::path& path, const cv::Mat& picture);

/// JPEG of quality 95 with full color resolution (4:4:4): color is what a gel measures with. Throws Error.
std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr);

}  // namespace gelslam
