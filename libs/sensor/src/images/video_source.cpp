#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "images/left_out.hpp"
#include "images/quiet.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

constexpr double most_pixels = 64e6;  // a header may claim anything; no touch sensor has more

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
  VideoSource(const fs::path& path, const SensorProfile& profile) : path_(path), profile_(profile) {
    silence_video_libraries();
    // An absolute path, so that FFmpeg does not take "name:x.avi" for a protocol.
    if (!capture_.open(fs::absolute(path).string(), cv::CAP_FFMPEG)) {
      throw Error(path.string() + ": not a video that can be read (or damaged from the start)");
    }
    width_ = static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_WIDTH));
    height_ = static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_HEIGHT));
    if (static_cast<double>(width_) * height_ > most_pixels) {
      throw Error(path.string() + ": frames of " + size_text() +
                  " pixels are larger than any touch sensor's");
    }
    rate_hz_ = usable_rate(capture_.get(cv::CAP_PROP_FPS), profile.frame_rate_hz);
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    if (std::isfinite(count) && count >= 1 && count < 1e9) count_ = static_cast<std::int64_t>(count);
  }

  std::optional<TactileImage> next() override {
    cv::Mat frame;
    while (!ended_ && capture_.read(frame) && !frame.empty()) {
      const std::string name = path_.string() + ", frame " + std::to_string(index_);
      if (frame.type() != CV_8UC3) throw Error(name + ": not an 8-bit color picture");
      TactileImage image;
      image.time_s = time_of_frame();
      image.index = index_++;
      if (is_gray(frame)) {
        pictures_.leave_out(name + ": " + gray_picture);
        continue;
      }
      image.bgr = fit_to_profile(frame, profile_, name);
      pictures_.use();
      return image;
    }
    finish();
    return std::nullopt;
  }

  std::optional<std::int64_t> frame_count() const override { return count_; }
  double rate_hz() const override { return rate_hz_; }

  std::string description() const override {
    std::ostringstream text;
    text << "video " << path_.filename().string() << ", " << size_text() << ", " << rate_hz_ << " Hz";
    return text.str();
  }

  std::string warning() const override { return joined({truncation_, pictures_.warning()}); }

 private:
  std::string size_text() const { return gelslam::size_text(width_, height_); }

  double time_of_frame() {
    const double container_s = capture_.get(cv::CAP_PROP_POS_MSEC) / 1000.0;
    if (index_ == 0) {
      first_s_ = std::isfinite(container_s) ? container_s : 0.0;
      return last_s_ = 0.0;
    }
    const double since_first_s = container_s - first_s_;
    const bool increases = std::isfinite(since_first_s) && since_first_s > last_s_;
    return last_s_ = increases ? since_first_s : last_s_ + 1.0 / rate_hz_;
  }

  void finish() {
    if (ended_) return;
    ended_ = true;
    pictures_.require_some(path_.string() + ": the video");
    if (count_ && index_ < *count_) {
      truncation_ = path_.string() + " ends after " + std::to_string(index_) + " of " +
                    std::to_string(*count_) + " frames; is it truncated?";
    }
  }

  fs::path path_;
  SensorProfile profile_;
  cv::VideoCapture capture_;
  int width_ = 0, height_ = 0;
  double rate_hz_ = 0.0;
  std::optional<std::int64_t> count_;
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
