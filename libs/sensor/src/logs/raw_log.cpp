#include "gelslam/sensor/raw_log.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "images/sources.hpp"
#include "logs/matroska_file.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using detail::MatroskaFile;

const char* name_of(FrameEncoding encoding) {
  switch (encoding) {
    case FrameEncoding::jpeg:
      return "jpeg";
    case FrameEncoding::png:
      return "png";
    case FrameEncoding::bgr:
      return "bgr";
    case FrameEncoding::yuyv:
      return "yuyv";
  }
  return "";
}

class MatroskaLog final : public RawFrameSource {
 public:
  MatroskaLog(const fs::path& path, std::unique_ptr<MatroskaFile> file, double profile_rate_hz)
      : path_(path),
        file_(std::move(file)),
        rate_hz_(file_->video().rate_hz > 0 ? file_->video().rate_hz : profile_rate_hz) {}

  std::optional<RawFrame> next() override {
    if (stopped_ || ended_) return std::nullopt;
    std::optional<MatroskaFile::Packet> packet = file_->next();
    if (!packet) {
      end();
      return std::nullopt;
    }
    const MatroskaFile::Video& video = file_->video();
    RawFrame frame;
    frame.encoding = *video.encoding;
    frame.width_px = video.width_px;
    frame.height_px = video.height_px;
    frame.bytes = std::move(packet->bytes);
    frame.time_s = time_of(*packet);
    frame.index = index_++;
    frame.sequence = packet->sequence.value_or(frame.index);
    if (frame.index > 0) count_gap(frame.sequence - last_sequence_ - 1);
    last_sequence_ = frame.sequence;
    frame.arrived = std::chrono::steady_clock::now();
    return frame;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return rate_hz_; }
  std::optional<std::int64_t> frame_count() const override { return file_->video().frames; }
  std::int64_t lost_frames() const override { return lost_; }
  std::string warning() const override { return warning_; }

  std::string description() const override {
    const MatroskaFile::Video& video = file_->video();
    return fmt::format("log {}, {}x{}, {:g} Hz, {}", path_.filename().string(), video.width_px,
                       video.height_px, rate_hz_, name_of(*video.encoding));
  }

 private:
  void count_gap(std::int64_t frames) {
    constexpr std::int64_t most = 1'000'000'000;  // damage may claim anything
    if (frames > 0) lost_ = std::min(lost_ + std::min(frames, most), most);
  }

  /// A repeated or backward time (damage, or a tool that rounds) would make a trajectory that no program
  /// takes.
  double time_of(const MatroskaFile::Packet& packet) {
    if (index_ == 0) {
      first_us_ = packet.time_us.value_or(0);
      return last_s_ = 0.0;
    }
    const double next_s = last_s_ + 1.0 / rate_hz_;
    if (!packet.time_us) return last_s_ = next_s;
    const double time_s = (static_cast<double>(*packet.time_us) - static_cast<double>(first_us_)) * 1e-6;
    return last_s_ = time_s > last_s_ ? time_s : next_s;
  }

  void end() {
    ended_ = true;
    const MatroskaFile::Video& video = file_->video();
    if (index_ == 0) throw Error(path_.string() + ": the log holds no readable frame");
    const std::string readable =
        std::to_string(index_) + " frames, " + std::to_string(last_s_).substr(0, 8) + " s";
    if (video.frames && ends_early()) {
      warning_ = path_.string() + " ends after " + std::to_string(index_) + " of " +
                 std::to_string(*video.frames) + " frames; is it truncated or damaged?";
    } else if (video.ours && !video.frames) {
      warning_ = path_.string() +
                 " was never closed (its program was killed, or is still writing); readable: " + readable;
    }
  }

  /// Other tools note a duration only, in which frames that the camera lost are missing.
  bool ends_early() const {
    const MatroskaFile::Video& video = file_->video();
    if (video.ours) return index_ < *video.frames;
    return static_cast<double>(first_us_) * 1e-6 + last_s_ + 2.5 / rate_hz_ < video.duration_s;
  }

  fs::path path_;
  std::unique_ptr<MatroskaFile> file_;
  double rate_hz_;
  std::int64_t index_ = 0, last_sequence_ = 0, lost_ = 0, first_us_ = 0;
  double last_s_ = 0;
  bool ended_ = false;
  std::atomic<bool> stopped_ = false;
  std::string warning_;
};

/// A source of decoded pictures as one of raw frames.
class DecodedLog final : public RawFrameSource {
 public:
  explicit DecodedLog(std::unique_ptr<FrameSource> source) : source_(std::move(source)) {}

  std::optional<RawFrame> next() override {
    if (stopped_) return std::nullopt;
    const std::optional<TactileImage> image = source_->next();
    if (!image) return std::nullopt;
    RawFrame frame;
    detail::put_picture(image->bgr, frame);
    frame.time_s = image->time_s;
    frame.index = frame.sequence = image->index;
    frame.arrived = std::chrono::steady_clock::now();
    return frame;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return source_->rate_hz(); }
  std::optional<std::int64_t> frame_count() const override { return source_->frame_count(); }
  std::string description() const override { return source_->description(); }
  std::string warning() const override { return source_->warning(); }

 private:
  std::unique_ptr<FrameSource> source_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace

LogAttachments read_log_attachments(const fs::path& log) { return MatroskaFile(log).attachments(); }

std::unique_ptr<RawFrameSource> detail::open_matroska_log(const fs::path& log, const SensorProfile& profile) {
  auto file = std::make_unique<MatroskaFile>(log);
  if (!file->video().encoding) return nullptr;
  return std::make_unique<MatroskaLog>(log, std::move(file), profile.frame_rate_hz);
}

std::unique_ptr<RawFrameSource> open_raw_log(const fs::path& log, const SensorProfile& profile) {
  if (is_matroska(log)) {
    if (auto source = detail::open_matroska_log(log, profile)) return source;
  }
  return std::make_unique<DecodedLog>(open_frame_source(log, profile));
}

}  // namespace gelslam
