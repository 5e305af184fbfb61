#include "gelslam/sensor/raw_log.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <deque>
#include <fstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "images/sources.hpp"
#include "images/video_file.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using detail::VideoFile;

constexpr std::size_t kSuccessors = 3;

/// Returns what follows the size in a log's description.
const char* ending_of(FrameEncoding encoding) {
  constexpr const char* kEndings[] = {", jpeg", ", png", "", ", yuyv"};
  return kEndings[static_cast<std::size_t>(encoding)];
}

class VideoLog final : public RawFrameSource {
 public:
  VideoLog(const fs::path& path, const SensorProfile& profile)
      : path_(path),
        file_(path, nullptr, profile.video_track),
        video_(file_.properties()),
        rate_hz_(video_.rate_hz > 0 ? video_.rate_hz : profile.frame_rate_hz),
        frames_(video_.frames) {
    read_ahead();
    if (profile.video_track == 0 && video_.tracks > 1)
      warning_ = fmt::format("{}: has {} video tracks; this is the first (video_track takes another)",
                             path.string(), video_.tracks);
    // The duration of a Matroska file is the time at which it ends.
    const bool is_late =
        !video_.frames_are_counted && is_matroska(path) && !ahead_.empty() && ahead_.front().time_us;
    if (frames_ && *frames_ > 0 && is_late)
      *frames_ -= std::clamp<std::int64_t>(
          std::llround(static_cast<double>(*ahead_.front().time_us) * 1e-6 * video_.rate_hz), 0,
          *frames_ - 1);
  }

  std::optional<RawFrame> next() override {
    if (stopped_ || ended_) return std::nullopt;
    read_ahead();
    if (ahead_.empty()) {
      end();
      return std::nullopt;
    }
    VideoFile::Packet packet = std::move(ahead_.front());
    ahead_.pop_front();
    RawFrame frame = std::move(packet.frame);
    frame.time_s = time_of(packet.time_us);
    frame.unix_us = unix_us_of(video_.start_unix_us, frame.time_s + 1e-6 * first_us_.value_or(0));
    frame.index = index_++;
    frame.name = path_.string() + ", frame " + std::to_string(frame.index);
    frame.sequence = packet.sequence.value_or(frame.index);
    if (frame.index > 0) count_gap(frame.sequence - last_sequence_ - 1);
    last_sequence_ = frame.sequence;
    frame.arrived = std::chrono::steady_clock::now();
    return frame;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return rate_hz_; }
  std::optional<std::int64_t> frame_count() const override { return frames_; }
  std::int64_t lost_frames() const override { return lost_; }
  std::string warning() const override {
    std::string words = warning_;
    if (wrong_times_ > 0)
      append_sentence(
          words, fmt::format("{}: {} contradicted by those around it, and mended", path_.string(),
                             counted(wrong_times_, "time stamp") + (wrong_times_ == 1 ? " is" : " are")));
    return words;
  }

  std::string description() const override {
    return fmt::format("{} {}, {}, {:g} Hz{}", video_.ours ? "log" : "video", path_.filename().string(),
                       size_text(video_.width_px, video_.height_px), rate_hz_,
                       video_.ours ? ending_of(video_.encoding) : "");
  }

 private:
  void read_ahead() {
    while (ahead_.size() <= kSuccessors && !file_ended_)
      if (std::optional<VideoFile::Packet> packet = file_.next())
        ahead_.push_back(std::move(*packet));
      else
        file_ended_ = true;
  }

  void count_gap(std::int64_t frames) {
    constexpr std::int64_t most = 1'000'000'000;  // Damaged data may claim any number.
    if (frames > 0) lost_ = std::min(lost_ + std::min(frames, most), most);
  }

  double seconds_of(std::int64_t time_us) const {
    return (static_cast<double>(time_us) - first_us_.value_or(0)) * 1e-6;
  }

  /// Says whether a time is wrong: at least two of the following frames, and most of them, have an earlier
  /// time.
  bool is_contradicted(std::int64_t time_us) const {
    const auto before = std::count_if(ahead_.begin(), ahead_.end(), [&](const VideoFile::Packet& next) {
      return next.time_us && *next.time_us < time_us && (index_ == 0 || seconds_of(*next.time_us) > last_s_);
    });
    return before > std::max<std::ptrdiff_t>(1, std::ssize(ahead_) / 2);
  }

  /// Returns a valid time of a frame. A time that repeats or goes backward (by damage, or a tool that rounds)
  /// would make an invalid trajectory; so would a time far ahead, after which all others go backward.
  double time_of(std::optional<std::int64_t> time_us) {
    const double next_s = index_ == 0 ? 0.0 : last_s_ + 1.0 / rate_hz_;
    if (!time_us) return last_s_ = next_s;
    if (is_contradicted(*time_us)) {
      ++wrong_times_;
      return last_s_ = index_ == 0 ? 0.0 : last_s_ + 0.5 / rate_hz_;  // Before the time of the next frame.
    }
    if (!first_us_) first_us_ = static_cast<double>(*time_us) - 1e6 * next_s;
    if (index_ > 0 && *time_us < newest_us_) ++wrong_times_;
    newest_us_ = std::max(newest_us_, *time_us);
    const double time_s = seconds_of(*time_us);
    return last_s_ = index_ == 0 || time_s > last_s_ ? time_s : next_s;
  }

  void end() {
    ended_ = true;
    if (index_ == 0) throw Error(path_.string() + ": the log holds no readable frame");
    if (frames_ && ends_early()) {
      append_sentence(warning_, path_.string() + " ends after " + std::to_string(index_) + " of " +
                                    std::to_string(*frames_) + " frames; is it truncated or damaged?");
    } else if (video_.ours && !frames_) {
      warning_ = fmt::format(
          "{} was never closed (its program was killed, or is still writing); readable: {} frames, {} s",
          path_.string(), index_, std::to_string(last_s_).substr(0, 8));
    }
  }

  /// If only a duration is known, it also contains frames that the camera lost.
  bool ends_early() const {
    if (video_.frames_are_counted) return index_ < *frames_;
    return first_us_.value_or(0) * 1e-6 + last_s_ + 2.5 / rate_hz_ < video_.duration_s;
  }

  fs::path path_;
  VideoFile file_;
  const VideoFile::Properties& video_;
  double rate_hz_;
  std::optional<std::int64_t> frames_;
  std::deque<VideoFile::Packet> ahead_;  ///< The following frames, from which a time is judged.
  bool file_ended_ = false;
  std::int64_t index_ = 0, last_sequence_ = 0, lost_ = 0, newest_us_ = 0, wrong_times_ = 0;
  std::optional<double> first_us_;  ///< Time of the first frame, from which times count.
  double last_s_ = 0;
  bool ended_ = false;
  std::atomic<bool> stopped_ = false;
  std::string warning_;
};

constexpr const char* kRos2Way =
    "; play it (ros2 bag play BAG) while its pictures are saved (ros2 run image_view image_saver --ros-args "
    "-r image:=TOPIC), and give their folder";

/// Throws Error for a file of a robotics system that contains images among other data, with advice how to
/// extract them.
void refuse_container(const fs::path& file) {
  std::string head(8, '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), std::ssize(head));
  if (head.starts_with("\x89MCAP")) throw Error(file.string() + ": an MCAP file" + kRos2Way);
  if (head.starts_with("#ROSBAG"))
    throw Error(file.string() +
                ": a bag of ROS 1; play it (rosbag play BAG) while its pictures are saved (rosrun image_view "
                "extract_images image:=TOPIC), and give their folder");
  if (head.starts_with("\x89HDF"))
    throw Error(
        file.string() +
        ": an HDF5 file; save its pictures (h5ls -r FILE names arrays), and give their folder: python3 "
        "-c \"import h5py, cv2; [cv2.imwrite(f'{i}.png', p[..., ::-1]) for i, p in "
        "enumerate(h5py.File('FILE')['ARRAY'])]\"");
}

/// The same for folders.
void refuse_dataset(const fs::path& folder) {
  std::error_code code;
  if (fs::exists(folder / "metadata.yaml", code))
    throw Error(folder.string() + ": a bag of ROS 2" + kRos2Way);
  if (!fs::exists(folder / "meta/info.json", code)) return;
  for (fs::recursive_directory_iterator entry(folder / "videos", code), end; !code && entry != end;
       entry.increment(code))
    if (entry->path().extension() == ".mp4")
      throw Error(folder.string() + ": a LeRobot data set; give one of its videos, as " +
                  entry->path().string());
}

std::unique_ptr<RawFrameSource> open_video(const fs::path& path, const SensorProfile& profile) {
  std::error_code code;
  const std::uintmax_t size = fs::file_size(path, code);
  if (code) throw Error(path.string() + ": cannot be read: " + code.message());
  if (size == 0) throw Error(path.string() + ": the file is empty");
  if (!std::ifstream(path)) throw Error(path.string() + ": cannot be opened; check its permissions");
  refuse_lfs_pointer(path);
  refuse_container(path);
  return std::make_unique<VideoLog>(path, profile);
}

std::unique_ptr<RawFrameSource> open_folder(const fs::path& folder, const SensorProfile& profile) {
  std::error_code code;
  for (const char* name : {"log.mkv", "gelsight.avi"})
    if (fs::exists(folder / name, code)) return open_raw_log(folder / name, profile);
  std::vector<fs::path> images = detail::list_images(folder);
  if (images.empty()) refuse_dataset(folder);
  if (images.empty())
    throw Error(folder.string() +
                ": the folder holds neither log.mkv nor gelsight.avi nor images (png, jpg, bmp)");
  return detail::open_image_folder(folder, std::move(images), profile);
}

}  // namespace

bool is_matroska(const fs::path& file) {
  std::error_code code;
  if (!fs::is_regular_file(file, code)) return false;
  std::array<char, 4> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return head == std::array<char, 4>{'\x1a', '\x45', '\xdf', '\xa3'};
}

LogAttachments read_log_attachments(const fs::path& log) {
  if (!is_matroska(log)) throw Error(log.string() + ": not a Matroska file that can be read");
  return VideoFile(log).attachments();
}

std::unique_ptr<RawFrameSource> open_raw_log(const fs::path& log, const SensorProfile& profile) {
  std::error_code code;
  const fs::file_status status = fs::status(log, code);
  if (!fs::exists(status)) throw Error(log.string() + ": no such file or folder");
  if (fs::is_directory(status)) return open_folder(log, profile);
  if (!fs::is_regular_file(status)) throw Error(log.string() + ": neither a file nor a folder");
  if (detail::has_image_ending(log))
    throw Error(log.string() + ": a single image; give the folder that holds the images, or a video");
  return open_video(log, profile);
}

std::unique_ptr<FrameSource> open_frame_source(const fs::path& log, const SensorProfile& profile) {
  return std::make_unique<FrameSource>(open_raw_log(log, profile), log.string(), profile);
}

}  // namespace gelslam
