#include "images/image_header.hpp"

#include <cstdlib>
#include <string_view>

namespace gelslam::detail {
namespace {

using Bytes = std::span<const unsigned char>;

bool starts_with(Bytes file, std::string_view signature) {
  if (file.size() < signature.size()) return false;
  for (std::size_t i = 0; i < signature.size(); ++i) {
    if (file[i] != static_cast<unsigned char>(signature[i])) return false;
  }
  return true;
}

std::int64_t big_endian(Bytes file, std::size_t at, std::size_t bytes) {
  std::int64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | file[at + i];
  return value;
}

std::int64_t little_endian_32(Bytes file, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | file[at + i];
  return static_cast<std::int32_t>(value);  // a BMP stored top-down has a negative height
}

/// Segments of a JPEG (ITU-T T.81, annex B): marker FF xx, then, for most, a length of two bytes that counts
/// itself.
class JpegWalker {
 public:
  explicit JpegWalker(Bytes file) : file_(file) {}

  std::optional<ImageHeader> walk() {
    ImageHeader header;
    header.complete = false;
    while (at_ + 2 <= file_.size() && file_[at_] == 0xff) {
      const unsigned char marker = file_[at_ + 1];
      header.complete = marker == end_of_image;
      if (header.complete || at_ + 4 > file_.size()) break;
      if (is_frame_header(marker) && at_ + 9 <= file_.size()) {
        header.height_px = big_endian(file_, at_ + 5, 2);
        header.width_px = big_endian(file_, at_ + 7, 2);
      }
      at_ += 2 + static_cast<std::size_t>(big_endian(file_, at_ + 2, 2));
      if (marker == start_of_scan) skip_scan();
    }
    if (header.width_px == 0) return std::nullopt;
    return header;
  }

 private:
  static constexpr unsigned char start_of_scan = 0xda, end_of_image = 0xd9;

  /// SOF0 to SOF15 but for the tables (DHT, JPG, DAC) among them.
  static bool is_frame_header(unsigned char marker) {
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
  }

  /// To the next marker that is neither a stuffed zero nor a restart.
  void skip_scan() {
    for (; at_ + 2 <= file_.size(); ++at_) {
      const unsigned char next = file_[at_ + 1];
      if (file_[at_] == 0xff && next != 0x00 && next != 0xff && (next < 0xd0 || next > 0xd7)) return;
    }
  }

  Bytes file_;
  std::size_t at_ = 2;  // behind FF D8
};

}  // namespace

std::optional<ImageHeader> peek_image_header(Bytes file) {
  if (starts_with(file, "\x89PNG\r\n\x1a\n") && file.size() >= 24) {
    return ImageHeader{big_endian(file, 16, 4), big_endian(file, 20, 4)};
  }
  if (starts_with(file, "BM") && file.size() >= 26) {
    return ImageHeader{little_endian_32(file, 18), std::abs(little_endian_32(file, 22))};
  }
  if (starts_with(file, "\xff\xd8\xff")) return JpegWalker(file).walk();
  return std::nullopt;
}

}  // namespace gelslam::detail
