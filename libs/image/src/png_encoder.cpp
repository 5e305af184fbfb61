#include <png.h>
#include <zlib.h>

#include <csetjmp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/encoders.hpp"

namespace gelslam {
namespace {

void append(png_structp png, png_bytep data, std::size_t size) {
  auto& bytes = *static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  bytes.insert(bytes.end(), data, data + size);
}

/// libpng leaves it by longjmp when it fails: it has no objects with destructors.
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
