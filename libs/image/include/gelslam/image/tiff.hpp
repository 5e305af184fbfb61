#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>

namespace gelslam {

/// What a TIFF's header says of its first picture.
struct TiffInfo {
  std::int64_t width_px = 0, height_px = 0;  ///< 0 x 0 when the header cannot be read
  int bits_per_channel = 0;
};

TiffInfo read_tiff_info(const std::filesystem::path& path);

/// The first picture, with 8 bits per channel, however it is compressed; empty when it is damaged.
cv::Mat3b read_tiff(const std::filesystem::path& path);

/// A TIFF of one 32-bit float per pixel. The file appears whole. Throws Error.
void write_float_tiff(const std::filesystem::path& path, const cv::Mat1f& values);

/// A TIFF of `channels` 32-bit floats per pixel; of four the first and the third change places, as they do in
/// OpenCV, which takes them for colors. Empty when the file is missing, damaged or of another size or kind.
cv::Mat read_float_tiff(const std::filesystem::path& path, cv::Size size, int channels);

}  // namespace gelslam
