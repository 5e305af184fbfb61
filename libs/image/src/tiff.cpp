#include "gelslam/image/tiff.hpp"

#include <tiffio.h>

#include <memory>
#include <mutex>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

using Tiff = std::unique_ptr<TIFF, void (*)(TIFF*)>;

/// What is wrong with a file is said by our errors.
Tiff open_tiff(const std::filesystem::path& path, const char* mode) {
  static std::once_flag once;
  std::call_once(once, [] {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
  });
  return {TIFFOpen(path.c_str(), mode), TIFFClose};
}

TiffInfo info_of(TIFF* tiff) {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
  return {width, height, bits};
}

bool holds_floats(TIFF* tiff, cv::Size size, int channels) {
  const TiffInfo info = info_of(tiff);
  std::uint16_t samples = 1, format = SAMPLEFORMAT_UINT, planes = PLANARCONFIG_CONTIG;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &planes);
  return info.width_px == size.width && info.height_px == size.height && samples == channels &&
         info.bits_per_channel == 32 && format == SAMPLEFORMAT_IEEEFP && planes == PLANARCONFIG_CONTIG &&
         TIFFIsTiled(tiff) == 0 && TIFFScanlineSize(tiff) == tmsize_t{size.width} * channels * 4;
}

bool write_rows(TIFF* tiff, const cv::Mat1f& values) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, values.cols);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, values.rows);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, values.rows);
  cv::Mat1f row;  // libtiff may swap its bytes
  for (int v = 0; v < values.rows; ++v) {
    values.row(v).copyTo(row);
    if (TIFFWriteScanline(tiff, row.data, static_cast<std::uint32_t>(v)) != 1) return false;
  }
  return TIFFFlush(tiff) == 1;
}

}  // namespace

TiffInfo read_tiff_info(const std::filesystem::path& path) {
  const Tiff tiff = open_tiff(path, "r");
  return tiff == nullptr ? TiffInfo{} : info_of(tiff.get());
}

cv::Mat3b read_tiff(const std::filesystem::path& path) {
  const Tiff tiff = open_tiff(path, "r");
  const TiffInfo info = tiff == nullptr ? TiffInfo{} : info_of(tiff.get());
  if (info.width_px == 0) return {};
  cv::Mat4b rgba(static_cast<int>(info.height_px), static_cast<int>(info.width_px));
  constexpr int kStopOnError = 1;
  if (TIFFReadRGBAImageOriented(
          tiff.get(), static_cast<std::uint32_t>(rgba.cols), static_cast<std::uint32_t>(rgba.rows),
          reinterpret_cast<std::uint32_t*>(rgba.data), ORIENTATION_TOPLEFT, kStopOnError) != 1)
    return {};
  cv::Mat3b bgr;
  cv::cvtColor(rgba, bgr, cv::COLOR_RGBA2BGR);
  return bgr;
}

void write_float_tiff(const std::filesystem::path& path, const cv::Mat1f& values) {
  TemporaryFile file(path);
  Tiff tiff = open_tiff(file.path(), "w");
  if (tiff == nullptr || !write_rows(tiff.get(), values))
    throw Error("cannot write " + path.string() + "; is the disk full?");
  tiff.reset();
  file.commit();
}

cv::Mat read_float_tiff(const std::filesystem::path& path, cv::Size size, int channels) {
  const Tiff tiff = open_tiff(path, "r");
  if (tiff == nullptr || !holds_floats(tiff.get(), size, channels)) return {};
  cv::Mat values(size, CV_32FC(channels));
  for (int v = 0; v < values.rows; ++v)
    if (TIFFReadScanline(tiff.get(), values.ptr(v), static_cast<std::uint32_t>(v)) != 1) return {};
  if (channels == 4) cv::cvtColor(values, values, cv::COLOR_RGBA2BGRA);
  return values;
}

}  // namespace gelslam
