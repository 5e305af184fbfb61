#include "gelslam/sensor/image_input.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "images/sources.hpp"
#include "images/video_file.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kLargestImageFileBytes = 256u << 20;

std::vector<unsigned char> read_bytes(const std::filesystem::path& path) {
  refuse_lfs_pointer(path);
  const std::string bytes = read_file(path);
  if (bytes.empty()) throw Error(path.string() + ": the file is empty");
  if (bytes.size() > kLargestImageFileBytes)
    throw Error(path.string() + ": larger than any image of a touch sensor");
  return {bytes.begin(), bytes.end()};
}

/// A BMP has its size in its header (the height is negative if rows run downward).
void check_bmp(const std::vector<unsigned char>& bytes, const std::filesystem::path& path) {
  std::int32_t size[2];
  if (bytes.size() < 26) return;
  std::memcpy(size, bytes.data() + 18, sizeof size);
  detail::check_picture_size(path, size[0], std::abs(std::int64_t{size[1]}));
}

RawFrame read_bmp(const std::vector<unsigned char>& bytes, const std::filesystem::path& path) {
  check_bmp(bytes, path);
  auto picture = detail::VideoFile(path, "bmp_pipe").next();
  return picture ? std::move(picture->frame) : RawFrame{};
}

RawFrame packet_of(std::vector<unsigned char> bytes, FrameEncoding encoding, std::int64_t width_px,
                   std::int64_t height_px, const std::filesystem::path& path) {
  RawFrame frame;
  if (width_px < 1 || height_px < 1) return frame;
  detail::check_picture_size(path, width_px, height_px);
  frame.encoding = encoding;
  frame.bytes = std::move(bytes);
  frame.width_px = static_cast<int>(width_px);
  frame.height_px = static_cast<int>(height_px);
  return frame;
}

RawFrame read_any(std::vector<unsigned char> bytes, const std::filesystem::path& path) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                              std::min<std::size_t>(bytes.size(), 8));
  if (head.starts_with("\xff\xd8")) {
    const JpegInfo info = JpegDecoder().read_header(bytes);
    return packet_of(std::move(bytes), FrameEncoding::jpeg, info.width_px, info.height_px, path);
  }
  if (head.starts_with("\x89PNG")) {
    const PngInfo info = check_png(bytes);
    return packet_of(std::move(bytes), FrameEncoding::png, info.width_px, info.height_px, path);
  }
  if (head.starts_with("BM")) return read_bmp(bytes, path);
  return {};
}

}  // namespace

RawFrame detail::read_image_file(const std::filesystem::path& path) {
  RawFrame frame;
  const std::string name = path.string(), beginning = name + ": ";
  try {
    frame = read_any(read_bytes(path), path);
    if (frame.bytes.empty()) frame.damage = "not a readable image (png, jpg or bmp), or damaged";
  } catch (const Error& error) {
    const std::string_view words = error.what();
    frame.damage = words.substr(words.starts_with(beginning) ? beginning.size() : 0);
  }
  frame.name = name;
  return frame;
}

cv::Mat3b read_image(const std::filesystem::path& path) {
  FrameDecoder decoder;
  const std::optional<TactileImage> image = decoder.decode(detail::read_image_file(path));
  if (!image) throw Error(decoder.first_damage());
  return image->bgr;
}

cv::Mat3b fit_to_profile(const cv::Mat3b& image, const SensorProfile& profile, const std::string& name) {
  const detail::PictureFit fit = detail::picture_fit(image.cols, image.rows, profile);
  if (fit == detail::PictureFit::never)
    throw Error(name + ": " + detail::wrong_size_text(image.cols, image.rows, profile));
  if (fit == detail::PictureFit::as_it_is) return image;
  cv::Mat3b result;
  cv::resize(image(detail::kept_window(image.size(), profile)), result,
             cv::Size(profile.width_px, profile.height_px), 0, 0, cv::INTER_AREA);
  return result;
}

ColorGain::ColorGain(const std::array<double, 3>& gain_bgr)
    : unchanged_(gain_bgr == std::array<double, 3>{1.0, 1.0, 1.0}) {
  for (int value = 0; value < 256; ++value)
    for (int channel = 0; channel < 3; ++channel)
      table_(0, value)[channel] =
          cv::saturate_cast<unsigned char>(value * gain_bgr[static_cast<std::size_t>(channel)]);
}

void ColorGain::apply(cv::Mat3b& bgr) const {
  if (!unchanged_) cv::LUT(bgr, table_, bgr);
}

}  // namespace gelslam
