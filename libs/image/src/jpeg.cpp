#include <turbojpeg.h>

#include <memory>
#include <new>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

/// Bytes between the last line and the end mark: some cameras fill up with zeros there. The picture is whole.
bool is_padding(std::string_view message) {
  return message.find("extraneous bytes before marker 0xd9") != std::string_view::npos;
}

std::string in_words(const std::string& message) {
  const auto says = [&](std::string_view part) { return message.find(part) != std::string::npos; };
  if (says("remature end") || says("starting image data") || says("nput file is empty"))
    return "JPEG ends early";
  if (says("Not a JPEG")) return "the bytes are no JPEG";
  return "JPEG is corrupt (" + one_line(message) + ")";
}

}  // namespace

JpegDecoder::JpegDecoder() : handle_(tjInitDecompress()) {
  if (handle_ == nullptr) throw std::bad_alloc();
}

JpegDecoder::~JpegDecoder() { tjDestroy(handle_); }

/// A header that breaks off leaves the library (2.1) waiting for its rest: it would refuse every later
/// picture.
void JpegDecoder::start_afresh() {
  tjDestroy(handle_);
  handle_ = tjInitDecompress();
  if (handle_ == nullptr) throw std::bad_alloc();
}

JpegInfo JpegDecoder::read_header(std::span<const std::uint8_t> bytes) {
  JpegInfo info;
  int subsampling = 0, color_space = 0;
  const int failed = tjDecompressHeader3(handle_, bytes.data(), static_cast<unsigned long>(bytes.size()),
                                         &info.width_px, &info.height_px, &subsampling, &color_space);
  if (failed != 0 && (tjGetErrorCode(handle_) != TJERR_WARNING || info.width_px < 1 || info.height_px < 1)) {
    damage_ = in_words(tjGetErrorStr2(handle_));
    start_afresh();
    return {};
  }
  info.color = color_space != TJCS_GRAY;
  return info;
}

bool JpegDecoder::decode(std::span<const std::uint8_t> bytes, const JpegInfo& info, int denominator,
                         cv::Mat3b& picture) {
  const tjscalingfactor scale{1, denominator};
  picture.create(TJSCALED(info.height_px, scale), TJSCALED(info.width_px, scale));
  const int strict = TJFLAG_LIMITSCANS | TJFLAG_STOPONWARNING;
  if (decompress(bytes, picture, strict)) return true;
  // As the first complaint it says that everything before it was in order.
  if (is_padding(tjGetErrorStr2(handle_))) return decompress(bytes, picture, TJFLAG_LIMITSCANS);
  damage_ = in_words(tjGetErrorStr2(handle_));
  return false;
}

bool JpegDecoder::decompress(std::span<const std::uint8_t> bytes, cv::Mat3b& picture, int flags) {
  const int failed =
      tjDecompress2(handle_, bytes.data(), static_cast<unsigned long>(bytes.size()), picture.data,
                    picture.cols, static_cast<int>(picture.step), picture.rows, TJPF_BGR, flags);
  return failed == 0 || ((flags & TJFLAG_STOPONWARNING) == 0 && tjGetErrorCode(handle_) == TJERR_WARNING);
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
