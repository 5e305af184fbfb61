#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

namespace gelslam {

/// A TIFF of one 32-bit float per pixel. The file appears whole. Throws Error.
void write_float_tiff(const std::filesystem::path& path, const cv::Mat1f& values);

/// A TIFF of `channels` 32-bit floats per pixel; of four the first and the third change places, as they do in
/// OpenCV, which takes them for colors. Empty when the file is missing, damaged or of another size
/// or kind.
cv::Mat read_float_tiff(const std::filesystem::path& path, cv::Size size, int channels);

}  // namespace gelslam
