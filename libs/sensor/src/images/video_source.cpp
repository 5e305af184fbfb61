#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "images/left_out.hpp"
#include "images/sources.hpp"
#include "images/video_file.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

/// FFmpeg would play a text file as terminal art, and follow a playlist to other files. Videos hold zero
/// bytes early.
bool looks_like_text(const fs::path& path) {
  std::array<char, 4096> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), head.size());
  const auto end = head.begin() + file.gcount();
  return std::find(head.begin(), end, '\0') == end;
}

double usable_rate(double container_rate, double profile_rate) {
  const bool usable = std::isfinite(container_rate) && container_rate >= 0.01 && container_rate <= 1000.0;
  return usable ? container_rate : profile_rate;
}

class VideoSource final : public FrameSource {
 public:
  VideoSource(const fs::path& path, const SensorProfile& profile)
      : path_(path),
        profile_(profile),
        video_(path),
        rate_hz_(usable_rate(video_.properties().rate_hz, profile.frame_rate_hz)) {}

  std::optional<TactileImage> next() override {
    while (!ended_) {
      const std::optional<VideoFile::Frame> frame = video_.next();
      if (!frame) break;
      const std::string name = path_.string() + ", frame " + std::to_string(index_);
      TactileImage image;
      image.time_s = time_of_frame(frame->time_s);
      image.index = index_++;
      if (is_gray(frame->bgr)) {
        pictures_.leave_out(name + ": " + kGrayPicture);
        continue;
      }
      image.bgr = fit_to_profile(frame->bgr, profile_, name);
      pictures_.use();
      return image;
    }
    finish();
    return std::nullopt;
  }

  std::optional<std::int64_t> frame_count() const override { return video_.properties().frames; }
  double rate_hz() const override { return rate_hz_; }

  std::string description() const override {
    return fmt::format("video {}, {}, {:g} Hz", path_.filename().string(),
                       size_text(video_.properties().width_px, video_.properties().height_px), rate_hz_);
  }

  std::string warning() const override { return joined({truncation_, pictures_.warning()}); }

 private:
  double time_of_frame(double container_s) {
    if (index_ == 0) {
      first_s_ = container_s;
      return last_s_ = 0.0;
    }
    const double since_first_s = container_s - first_s_;
    return last_s_ = since_first_s > last_s_ ? since_first_s : last_s_ + 1.0 / rate_hz_;
  }

  void finish() {
    if (ended_) return;
    ended_ = true;
    pictures_.require_some(path_.string() + ": the video");
    if (const auto count = frame_count(); count && index_ < *count) {
      truncation_ = path_.string() + " ends after " + std::to_string(index_) + " of " +
                    std::to_string(*count) + " frames; is it truncated?";
    }
  }

  fs::path path_;
  SensorProfile profile_;
  VideoFile video_;
  double rate_hz_;
  std::int64_t index_ = 0;
  double first_s_ = 0.0, last_s_ = 0.0;
  bool ended_ = false;
  std::string truncation_;
  LeftOut pictures_;
};

}  // namespace

std::unique_ptr<FrameSource> open_video(const fs::path& path, const SensorProfile& profile) {
  std::error_code code;
  const std::uintmax_t size = fs::file_size(path, code);
  if (code) throw Error(path.string() + ": cannot be read: " + code.message());
  if (size == 0) throw Error(path.string() + ": the file is empty");
  if (!std::ifstream(path)) throw Error(path.string() + ": cannot be opened; check its permissions");
  if (looks_like_text(path)) throw Error(path.string() + ": not a video, but text");
  return std::make_unique<VideoSource>(path, profile);
}

}  // namespace gelslam::detail
