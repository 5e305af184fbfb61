#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "images/sources.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kMaxBytes = 512u << 20;

std::string name_of(const RawFrame& frame) {
  return frame.name.empty() ? "frame " + std::to_string(frame.index) : frame.name;
}

/// Exception for a frame that is left out, with the reason.
struct Damaged {
  std::string why;
};

/// Compares the announced size with that in the header, because a broken header may claim any size.
void check_size(const RawFrame& frame, std::int64_t width_px, std::int64_t height_px) {
  const bool announced = frame.width_px > 0 && frame.height_px > 0;
  if (announced && (frame.width_px != width_px || frame.height_px != height_px))
    throw Damaged{"the picture says it is " + size_text(width_px, height_px) + " pixels, announced were " +
                  size_text(frame.width_px, frame.height_px)};
  if (width_px < 1 || height_px < 1 || !detail::fits_any_sensor(width_px, height_px))
    throw Damaged{size_text(width_px, height_px) + " pixels are more than any touch sensor has"};
}

/// True when the channels of no pixel differ by more than two gray levels. Such an image has no color from
/// which slopes can be read. Video compression causes false color of one or two levels.
bool is_gray(const cv::Mat3b& image) {
  for (int v = 0; v < image.rows; ++v) {
    const cv::Vec3b* row = image[v];
    for (int u = 0; u < image.cols; ++u) {
      const auto [low, high] = std::minmax({row[u][0], row[u][1], row[u][2]});
      if (high - low > 2) return false;
    }
  }
  return true;
}

}  // namespace

struct FrameDecoder::Impl {
  void refuse_wrong_size(const RawFrame& frame, std::int64_t width_px, std::int64_t height_px) const {
    if (profile && detail::picture_fit(width_px, height_px, *profile) == detail::PictureFit::never)
      throw Error(name_of(frame) + ": " + detail::wrong_size_text(width_px, height_px, *profile));
  }

  /// Returns the factor by which a JPEG may be reduced while it is decoded.
  int denominator_of(cv::Size raw) const {
    if (!profile) return 1;
    const cv::Rect window = detail::kept_window(raw, *profile);
    int denominator = 1;
    while (denominator < 4 && window.width >= 2 * denominator * profile->width_px &&
           window.height >= 2 * denominator * profile->height_px)
      denominator *= 2;
    return denominator;
  }

  /// Crops and resizes. The window refers to the raw image, whatever scale it was decoded at.
  cv::Mat3b fit(const cv::Mat3b& picture, cv::Size raw, int denominator) const {
    const cv::Size size = profile ? cv::Size(profile->width_px, profile->height_px) : raw;
    if (picture.size() == size && raw == size) return picture.clone();
    const cv::Rect window = detail::kept_window(raw, *profile);
    const double scale = 1.0 / denominator;
    const cv::Rect2d scaled(window.x * scale, window.y * scale, window.width * scale, window.height * scale);
    return detail::area_resample(picture, scaled, size);
  }

  cv::Mat3b decode_jpeg(const RawFrame& frame) {
    const JpegInfo info = jpeg.read_header(frame.bytes);
    if (info.width_px == 0) throw Damaged{jpeg.damage()};
    check_size(frame, info.width_px, info.height_px);
    if (!info.unfit.empty()) throw Damaged{info.unfit};
    refuse_wrong_size(frame, info.width_px, info.height_px);
    const cv::Size raw(info.width_px, info.height_px);
    const int denominator = denominator_of(raw);
    if (!jpeg.decode(frame.bytes, info, denominator, decoded)) throw Damaged{jpeg.damage()};
    return fit(decoded, raw, denominator);
  }

  cv::Mat3b decode_png(const RawFrame& frame) const {
    const PngInfo info = check_png(frame.bytes);
    if (!info.damage.empty()) throw Damaged{info.damage};
    check_size(frame, info.width_px, info.height_px);
    if (!info.color) throw Damaged{kGrayPicture};
    if (info.bits_per_channel > 8) throw Damaged{"needs 8 bits per channel"};
    refuse_wrong_size(frame, info.width_px, info.height_px);
    const cv::Mat3b picture = gelslam::decode_png(frame.bytes);
    if (picture.empty()) throw Damaged{"PNG is corrupt"};
    return fit(picture, picture.size(), 1);
  }

  cv::Mat3b decode_plain(const RawFrame& frame, int bytes_per_pixel) {
    check_size(frame, frame.width_px, frame.height_px);
    refuse_wrong_size(frame, frame.width_px, frame.height_px);
    const std::size_t needed = static_cast<std::size_t>(frame.width_px) *
                               static_cast<std::size_t>(frame.height_px * bytes_per_pixel);
    if (frame.bytes.size() < needed)
      throw Damaged{"the picture ends early: " + std::to_string(frame.bytes.size()) + " of " +
                    std::to_string(needed) + " bytes"};
    const cv::Mat wrapped(frame.height_px, frame.width_px, CV_8UC(bytes_per_pixel),
                          const_cast<std::uint8_t*>(frame.bytes.data()));
    if (bytes_per_pixel == 3) return fit(wrapped, wrapped.size(), 1);
    if (frame.width_px % 2 != 0) throw Damaged{"a YUYV picture of odd width"};
    cv::cvtColor(wrapped, decoded, cv::COLOR_YUV2BGR_YUYV);
    return fit(decoded, decoded.size(), 1);
  }

  cv::Mat3b decode(const RawFrame& frame) {
    if (!frame.damage.empty()) throw Damaged{frame.damage};
    if (frame.bytes.empty()) throw Damaged{"the frame is empty"};
    if (frame.bytes.size() > kMaxBytes)
      throw Damaged{"the frame is larger than any picture of a touch sensor"};
    if (frame.encoding == FrameEncoding::jpeg) return decode_jpeg(frame);
    if (frame.encoding == FrameEncoding::png) return decode_png(frame);
    return decode_plain(frame, frame.encoding == FrameEncoding::bgr ? 3 : 2);
  }

  /// Counts images that are exact copies of the previous one, which no camera produces, and finds the longest
  /// time without any change.
  void compare_with_last(const cv::Mat3b& picture, const RawFrame& frame) {
    const bool is_copy = last.size() == picture.size() &&
                         std::memcmp(last.data, picture.data, picture.total() * picture.elemSize()) == 0;
    copies += is_copy;
    if (is_copy) return;
    picture.copyTo(last);
    const double still_s = good > 0 ? frame.time_s - changed_s : 0;
    changed_s = frame.time_s;
    if (still_s <= longest_still_s) return;
    longest_still_s = still_s;
    first_moving = name_of(frame);
  }

  std::optional<SensorProfile> profile;  ///< If empty, images keep their size.
  JpegDecoder jpeg{};
  cv::Mat3b decoded{};  // Kept, so that no memory is allocated for each frame.
  std::string damage{}, first_damage{};
  std::int64_t good = 0, left_out = 0;
  cv::Mat3b last{};  // The last good image.
  // Time of the last change, and the longest time without change.
  double changed_s = 0, longest_still_s = 0;
  std::string first_moving{};  // First frame after the longest time without change.
  std::int64_t copies = 0;
};

FrameDecoder::FrameDecoder(const std::optional<SensorProfile>& profile) : impl_(new Impl{profile}) {}
FrameDecoder::~FrameDecoder() = default;

std::optional<TactileImage> FrameDecoder::decode(const RawFrame& frame) {
  Impl& i = *impl_;
  try {
    i.damage.clear();
    const cv::Mat3b picture = i.decode(frame);
    if (is_gray(picture)) throw Damaged{kGrayPicture};
    i.compare_with_last(picture, frame);
    ++i.good;
    const bool has_clock = !i.profile || !i.profile->counts_from_start;
    return TactileImage{picture, frame.time_s, frame.index, has_clock ? frame.unix_us : 0};
  } catch (const Damaged& damaged) {
    i.damage = damaged.why;
  }
  if (i.left_out++ == 0) i.first_damage = name_of(frame) + ": " + i.damage;
  return std::nullopt;
}

const std::string& FrameDecoder::damage() const { return impl_->damage; }
std::int64_t FrameDecoder::good() const { return impl_->good; }
std::int64_t FrameDecoder::left_out() const { return impl_->left_out; }
const std::string& FrameDecoder::first_damage() const { return impl_->first_damage; }

std::string FrameDecoder::warning() const {
  const Impl& i = *impl_;
  std::string text;
  if (i.left_out > 0)
    text = "left out " + counted(i.left_out, "damaged picture") + " (the first: " + i.first_damage + ")";
  constexpr std::int64_t fewest_copies = 10;
  if (i.copies >= fewest_copies && 2 * i.copies >= i.good)
    append_sentence(text,
                    std::to_string(i.copies) + " of " + std::to_string(i.good) +
                        " pictures are copies of the one before; did the recording program repeat them?");
  // In a log with few images per second, such intervals are normal.
  const double usual_s = i.good > 1 ? i.changed_s / static_cast<double>(i.good - 1) : 0;
  if (i.longest_still_s >= std::max(1.0, 5 * usual_s))
    append_sentence(text, "nothing new was seen for " + short_number(i.longest_still_s, 2) + " s before " +
                              i.first_moving + "; motion in that time is missing");
  return text;
}

FrameSource::FrameSource(std::shared_ptr<RawFrameSource> raw, std::string name, const SensorProfile& profile)
    : raw_(std::move(raw)), name_(std::move(name)), decoder_(profile) {}

std::optional<TactileImage> FrameSource::next() {
  // If a log begins with this many damaged images, it is probably not a log.
  constexpr std::int64_t patience = 10;
  while (std::optional<RawFrame> frame = raw_->next()) {
    if (frame->name.empty()) frame->name = name_ + ", frame " + std::to_string(frame->index);
    if (std::optional<TactileImage> image = decoder_.decode(*frame)) return image;
    if (decoder_.good() == 0 && decoder_.left_out() == patience) break;
  }
  if (decoder_.good() == 0 && decoder_.left_out() > 0) throw Error(decoder_.first_damage());
  return std::nullopt;
}

std::string FrameSource::warning() const {
  std::string text = raw_->warning();
  append_sentence(text, decoder_.warning());
  return text;
}

}  // namespace gelslam
