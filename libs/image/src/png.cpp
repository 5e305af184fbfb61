#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <vector>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

using Bytes = std::span<const std::uint8_t>;
constexpr std::array<std::uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

std::uint32_t big_endian_32(Bytes bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

bool checksum_matches(Bytes chunk) {
  const Bytes named = chunk.subspan(4, chunk.size() - 8);
  return crc32_of({reinterpret_cast<const char*>(named.data()), named.size()}) ==
         big_endian_32(chunk.last(4));
}

/// Calls use(type, chunk) for every chunk up to the end mark; if it returns false, the chunk is damaged.
/// Returns an empty string, or how the file is damaged.
template <typename Use>
std::string for_each_chunk(Bytes bytes, const Use& use) {
  if (bytes.size() < kPngSignature.size() ||
      !std::equal(kPngSignature.begin(), kPngSignature.end(), bytes.begin()))
    return "the bytes are no PNG";
  constexpr std::size_t around = 12;  // length, type and checksum of a chunk
  for (Bytes rest = bytes.subspan(kPngSignature.size());;) {
    if (rest.size() < around || big_endian_32(rest) > rest.size() - around) return "PNG ends early";
    const Bytes chunk = rest.first(around + big_endian_32(rest));
    const std::string_view type(reinterpret_cast<const char*>(chunk.data()) + 4, 4);
    if (!use(type, chunk)) return "PNG is corrupt (wrong checksum)";
    if (type == "IEND") return "";
    rest = rest.subspan(chunk.size());
  }
}

/// Removes chunks that are not needed for decoding (their names begin with a small letter). Otherwise libpng
/// would apply gAMA and change the values.
std::vector<std::uint8_t> critical_chunks(Bytes bytes) {
  std::vector<std::uint8_t> kept(kPngSignature.begin(), kPngSignature.end());
  for_each_chunk(bytes, [&](std::string_view type, Bytes chunk) {
    if (type[0] < 'a') kept.insert(kept.end(), chunk.begin(), chunk.end());
    return true;  // libpng checks the checksums.
  });
  return kept;
}

void append(png_structp png, png_bytep data, std::size_t size) {
  auto& bytes = *static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  bytes.insert(bytes.end(), data, data + size);
}

/// libpng leaves this function by longjmp when it fails, so it must not have objects with destructors.
bool encode(png_structp png, png_infop info, const cv::Mat& picture) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, Z_RLE);
  png_set_filter(png, 0, PNG_FILTER_SUB);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.cols), static_cast<png_uint_32>(picture.rows), 8,
               picture.channels() == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  png_set_bgr(png);
  for (int v = 0; v < picture.rows; ++v) png_write_row(png, picture.ptr(v));
  png_write_end(png, info);
  return true;
}

}  // namespace

PngInfo check_png(Bytes bytes) {
  PngInfo info;
  info.damage = for_each_chunk(bytes, [&](std::string_view type, Bytes chunk) {
    if (type == "IHDR" && chunk.size() >= 25) {
      info.width_px = big_endian_32(chunk.subspan(8));
      info.height_px = big_endian_32(chunk.subspan(12));
      info.bits_per_channel = chunk[16];
      info.color = (chunk[17] & PNG_COLOR_MASK_COLOR) != 0;
    }
    return checksum_matches(chunk);
  });
  if (info.damage.empty() && (info.width_px == 0 || info.height_px == 0)) info.damage = "PNG has no header";
  return info;
}

cv::Mat3b decode_png(Bytes bytes) {
  const std::vector<std::uint8_t> critical = critical_chunks(bytes);
  png_image image{};  // libpng's simplified interface prints nothing to stderr.
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, critical.data(), critical.size()) == 0) return {};
  if ((image.format & PNG_FORMAT_FLAG_COLOR) == 0 || (image.format & PNG_FORMAT_FLAG_LINEAR) != 0) {
    png_image_free(&image);
    return {};
  }
  image.format = PNG_FORMAT_BGRA;  // With a format without alpha, libpng would blend.
  cv::Mat4b bgra(static_cast<int>(image.height), static_cast<int>(image.width));
  if (png_image_finish_read(&image, nullptr, bgra.data, static_cast<png_int_32>(bgra.step[0]), nullptr) == 0)
    return {};
  cv::Mat3b bgr;
  cv::cvtColor(bgra, bgr, cv::COLOR_BGRA2BGR);
  return bgr;
}

std::vector<std::uint8_t> encode_png(const cv::Mat& picture) {
  CV_Assert(picture.type() == CV_8UC1 || picture.type() == CV_8UC3);
  const auto silent = [](png_structp, png_const_charp) {};
  const auto fail = [](png_structp png, png_const_charp) { png_longjmp(png, 1); };
  std::vector<std::uint8_t> bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, silent);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info != nullptr) png_set_write_fn(png, &bytes, append, [](png_structp) {});
  const bool good = info != nullptr && encode(png, info, picture);
  png_destroy_write_struct(&png, &info);
  if (!good) throw Error("cannot encode a picture as PNG");
  return bytes;
}

void write_png(const std::filesystem::path& path, const cv::Mat& picture) {
  const std::vector<std::uint8_t> bytes = encode_png(picture);
  write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace gelslam
