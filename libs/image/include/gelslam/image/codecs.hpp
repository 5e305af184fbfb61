#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

namespace gelslam {

/// Reason to refuse a gray image, for the user.
inline constexpr const char* kGrayPicture = "a gray picture; slopes are read from the sensor's colors";

struct JpegInfo {
  int width_px = 0, height_px = 0;  ///< 0 x 0 when the header cannot be read
  std::string unfit{};  ///< Why it is no upright color image: gray, CMYK, rotated by its EXIF data; or "".
};

/// A decoder (libjpeg-turbo) that describes what is wrong with a damaged image.
class JpegDecoder {
 public:
  JpegDecoder();

  JpegInfo read_header(std::span<const std::uint8_t> bytes);
  /// Decodes the whole image at 1/denominator of its size (1, 2 or 4; rounded up). Returns false when the
  /// data are truncated or corrupt; damage() then says how. The memory of `picture` is reused if its size
  /// matches.
  bool decode(std::span<const std::uint8_t> bytes, const JpegInfo& info, int denominator, cv::Mat3b& picture);
  const std::string& damage() const { return damage_; }

 private:
  bool decompress(std::span<const std::uint8_t> bytes, cv::Mat3b& picture, int flags);

  std::unique_ptr<void, int (*)(void*)> handle_;
  std::string damage_;
};

/// Contents of a PNG's header, and whether the file is complete.
struct PngInfo {
  std::int64_t width_px = 0, height_px = 0;
  int bits_per_channel = 0;
  bool color = false;
  std::string damage;  ///< "" if every chunk up to the end mark is complete and has the right checksum.
};

/// Reads only headers and checksums.
PngInfo check_png(std::span<const std::uint8_t> bytes);

/// Decodes a color image with 8 bits per channel; returns an empty one for everything else. Values are those
/// in the file; gamma and color profiles are ignored, and alpha is dropped.
cv::Mat3b decode_png(std::span<const std::uint8_t> bytes);

/// Encodes a gray or BGR image with 8 bits per channel as PNG. It is compressed for speed: 3 ms for a gel
/// image of 320 x 240 pixels, 10 % larger than with the best compression. Throws Error.
std::vector<std::uint8_t> encode_png(const cv::Mat& picture);

/// Writes such a PNG to a file, which appears when it is complete. Throws Error.
void write_png(const std::filesystem::path& path, const cv::Mat& picture);

/// Encodes a JPEG of quality 95 with full color resolution (4:4:4), because the sensor measures by color.
/// Throws Error.
std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr);

}  // namespace gelslam
