#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <new>
#include <string>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

constexpr const char* kEndsEarly = "JPEG ends early";
constexpr std::array<std::uint8_t, 2> kEndMark{0xff, 0xd9};

/// Appends the end mark that some cameras and tools leave out, unless the image is progressive. Without it,
/// the decoder would report missing lines; a progressive image that ends early may lack detail instead of
/// lines, which would remain unnoticed.
std::vector<std::uint8_t> with_end_mark(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 2> progressive{0xff, 0xc2};
  std::vector<std::uint8_t> ended(bytes.begin(), bytes.end());
  if (std::ranges::search(bytes, progressive).empty())
    ended.insert(ended.end(), kEndMark.begin(), kEndMark.end());
  return ended;
}

/// Says whether the decoder complains only about zeros between the last line and the end mark, which some
/// cameras use as padding; the image is then complete. Other bytes are remains of damaged lines.
bool is_padding(const std::string& message, std::span<const std::uint8_t> bytes) {
  unsigned count = 0;
  if (std::sscanf(message.c_str(), "Corrupt JPEG data: %u extraneous bytes before marker 0xd9", &count) != 1)
    return false;
  const auto end = std::find_end(bytes.begin(), bytes.end(), kEndMark.begin(), kEndMark.end());
  return end - bytes.begin() >= static_cast<std::ptrdiff_t>(count) &&
         std::all_of(end - static_cast<std::ptrdiff_t>(count), end,
                     [](std::uint8_t byte) { return byte == 0; });
}

std::string in_words(const std::string& message) {
  const auto says = [&](std::string_view part) { return message.find(part) != std::string::npos; };
  if (says("remature end") || says("starting image data") || says("nput file is empty")) return kEndsEarly;
  if (says("Not a JPEG")) return "the bytes are no JPEG";
  return "JPEG is corrupt (" + one_line(message) + ")";
}

std::size_t number_at(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count, bool little) {
  std::size_t number = 0;
  for (std::size_t i = 0; i < count; ++i)
    number = number << 8 | (at + i < bytes.size() ? bytes[at + (little ? count - 1 - i : i)] : 0U);
  return number;
}

/// Returns the EXIF orientation, 1 to 8; 1 (upright) if the data contain none.
int exif_orientation(std::span<const std::uint8_t> bytes) {
  std::size_t at = 2;  // Searches the segments before the image data.
  while (at + 4 < bytes.size() && bytes[at] == 0xff && bytes[at + 1] != 0xda) {
    const std::size_t length = number_at(bytes, at + 2, 2, false);
    const std::size_t tiff = at + 10, next = at + 2 + length;
    if (bytes[at + 1] == 0xe1 && length > 16 && next <= bytes.size() && bytes[at + 4] == 'E' &&
        bytes[at + 5] == 'x') {
      const auto exif = bytes.subspan(tiff, next - tiff);
      const bool little = exif[0] == 'I';
      const std::size_t list = number_at(exif, 4, 4, little), count = number_at(exif, list, 2, little);
      for (std::size_t entry = list + 2; entry < list + 2 + 12 * count && entry + 12 <= exif.size();
           entry += 12) {
        if (number_at(exif, entry, 2, little) != 0x0112) continue;
        const std::size_t orientation = number_at(exif, entry + 8, 2, little);
        return orientation >= 1 && orientation <= 8 ? static_cast<int>(orientation) : 1;
      }
    }
    at = next;
  }
  return 1;
}

std::unique_ptr<void, int (*)(void*)> new_decoder() {
  std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), tjDestroy);
  if (!decoder) throw std::bad_alloc();
  return decoder;
}

}  // namespace

JpegDecoder::JpegDecoder() : handle_(new_decoder()) {}

JpegInfo JpegDecoder::read_header(std::span<const std::uint8_t> bytes) {
  JpegInfo info;
  int subsampling = 0, color_space = 0;
  const int failed =
      tjDecompressHeader3(handle_.get(), bytes.data(), static_cast<unsigned long>(bytes.size()),
                          &info.width_px, &info.height_px, &subsampling, &color_space);
  if (failed != 0 &&
      (tjGetErrorCode(handle_.get()) != TJERR_WARNING || info.width_px < 1 || info.height_px < 1)) {
    damage_ = in_words(tjGetErrorStr2(handle_.get()));
    // A truncated header leaves the library (2.1) waiting for the rest, so that it would refuse every later
    // header.
    handle_ = new_decoder();
    return {};
  }
  const int orientation = exif_orientation(bytes);
  if (color_space == TJCS_GRAY) {
    info.unfit = kGrayPicture;
  } else if (color_space == TJCS_CMYK || color_space == TJCS_YCCK) {
    info.unfit = "a CMYK picture, made for printing; save it as RGB";
  } else if (orientation != 1) {
    info.unfit = "its EXIF data say that it is shown turned or mirrored (orientation " +
                 std::to_string(orientation) + "); save it upright, without them";
  }
  return info;
}

bool JpegDecoder::decode(std::span<const std::uint8_t> bytes, const JpegInfo& info, int denominator,
                         cv::Mat3b& picture) {
  const tjscalingfactor scale{1, denominator};
  picture.create(TJSCALED(info.height_px, scale), TJSCALED(info.width_px, scale));
  const int strict = TJFLAG_LIMITSCANS | TJFLAG_STOPONWARNING;
  if (decompress(bytes, picture, strict)) return true;
  std::vector<std::uint8_t> ended;
  if (in_words(tjGetErrorStr2(handle_.get())) == std::string_view(kEndsEarly)) {
    ended = with_end_mark(bytes);
    bytes = ended;
    if (decompress(bytes, picture, strict)) return true;
  }
  // Being the first complaint, it means that everything before was in order.
  if (is_padding(tjGetErrorStr2(handle_.get()), bytes)) return decompress(bytes, picture, TJFLAG_LIMITSCANS);
  damage_ = in_words(tjGetErrorStr2(handle_.get()));
  return false;
}

bool JpegDecoder::decompress(std::span<const std::uint8_t> bytes, cv::Mat3b& picture, int flags) {
  const int failed =
      tjDecompress2(handle_.get(), bytes.data(), static_cast<unsigned long>(bytes.size()), picture.data,
                    picture.cols, static_cast<int>(picture.step), picture.rows, TJPF_BGR, flags);
  return failed == 0 ||
         ((flags & TJFLAG_STOPONWARNING) == 0 && tjGetErrorCode(handle_.get()) == TJERR_WARNING);
}

std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr) {
  constexpr int quality = 95;
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool good = encoder != nullptr &&
                    tjCompress2(encoder.get(), bgr.data, bgr.cols, static_cast<int>(bgr.step[0]), bgr.rows,
                                TJPF_BGR, &bytes, &size, TJSAMP_444, quality, TJFLAG_ACCURATEDCT) == 0;
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  if (!good) throw Error("cannot encode a picture as JPEG");
  return {bytes, bytes + size};
}

}  // namespace gelslam
