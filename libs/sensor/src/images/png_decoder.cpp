#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "gelslam/core/crc32.hpp"
#include "images/decoders.hpp"

namespace gelslam::detail {
namespace {

using Bytes = std::span<const std::uint8_t>;
constexpr std::array<std::uint8_t, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

std::uint32_t big_endian_32(Bytes bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

}  // namespace

PngInfo check_png(Bytes bytes) {
  PngInfo info;
  if (bytes.size() < signature.size() || !std::equal(signature.begin(), signature.end(), bytes.begin())) {
    info.damage = "the bytes are no PNG";
    return info;
  }
  constexpr std::size_t around = 12;  // length, type and checksum of a chunk
  for (Bytes rest = bytes.subspan(signature.size());;) {
    if (rest.size() < around || big_endian_32(rest) > rest.size() - around) {
      info.damage = "PNG ends early";
      return info;
    }
    const std::size_t length = big_endian_32(rest);
    const Bytes named = rest.subspan(4, 4 + length);  // what the checksum is over
    const std::string_view chunk(reinterpret_cast<const char*>(named.data()), named.size());
    const std::string_view type = chunk.substr(0, 4);
    if (type == "IHDR" && length >= 8) {
      info.width_px = big_endian_32(named.subspan(4));
      info.height_px = big_endian_32(named.subspan(8));
    }
    if (crc32_of(chunk) != big_endian_32(rest.subspan(8 + length))) {
      info.damage = "PNG is corrupt (wrong checksum)";
      return info;
    }
    if (type == "IEND") break;
    rest = rest.subspan(around + length);
  }
  if (info.width_px == 0 || info.height_px == 0) info.damage = "PNG has no header";
  return info;
}

cv::Mat3b decode_png(Bytes bytes) {
  cv::Mat image;
  try {
    const cv::Mat wrapped(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::uint8_t*>(bytes.data()));
    image = cv::imdecode(wrapped, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};
  }
  if (image.type() == CV_8UC3) return image;
  cv::Mat3b bgr;
  if (image.type() == CV_8UC4) cv::cvtColor(image, bgr, cv::COLOR_BGRA2BGR);
  return bgr;
}

}  // namespace gelslam::detail
