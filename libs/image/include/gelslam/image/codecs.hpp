#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>
#include <vector>

namespace gelslam {

/// Why a gray picture is refused, for the user.
inline constexpr const char* kGrayPicture = "a gray picture; slopes are read from the sensor's colors";

struct JpegInfo {
  int width_px = 0, height_px = 0;  ///< 0 x 0 when the header cannot be read
  std::string unfit{};  ///< why it is no upright color picture: gray, CMYK, turned by its EXIF data; or ""
};

/// A decoder (libjpeg-turbo) that says in words what is wrong with a damaged picture.
class JpegDecoder {
 public:
  JpegDecoder();

  JpegInfo read_header(std::span<const std::uint8_t> bytes);
  /// The whole picture at 1/denominator of its size (1, 2 or 4; rounded up). False when the bytes are torn or
  /// corrupt; damage() says how. `picture`'s memory is used again where its size allows.
  bool decode(std::span<const std::uint8_t> bytes, const JpegInfo& info, int denominator, cv::Mat3b& picture);
  const std::string& damage() const { return damage_; }

 private:
  bool decompress(std::span<const std::uint8_t> bytes, cv::Mat3b& picture, int flags);

  std::unique_ptr<void, int (*)(void*)> handle_;
  std::string damage_;
};

/// What a PNG's header says, and whether the file is complete.
struct PngInfo {
  std::int64_t width_px = 0, height_px = 0;
  int bits_per_channel = 0;
  bool color = false;
  std::string damage;  ///< "" when every chunk up to the end mark is whole, by its checksum
};

/// Reads nothing but headers and checksums.
PngInfo check_png(std::span<const std::uint8_t> bytes);

/// Color, 8 bits per channel; empty for everything else. The values as they are in the file, whatever it says
/// about gamma and color profiles; alpha is dropped.
cv::Mat3b decode_png(std::span<const std::uint8_t> bytes);

/// PNG of a gray or BGR picture with 8 bits per channel. Compressed for speed: 3 ms for 320 x 240 pixels of a
/// gel, 10 % larger than the best. Throws Error.
std::vector<std::uint8_t> encode_png(const cv::Mat& picture);

/// The same as a file, which appears whole. Throws Error.
void write_png(const std::filesystem::path& path, const cv::Mat& picture);

/// JPEG of quality 95 with full color resolution (4:4:4): color is what a gel measures with. Throws Error.
std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr);

}  // namespace gelslam
