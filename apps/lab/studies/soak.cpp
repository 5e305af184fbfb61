// Soak test: runs the live system on full-size camera images for any length of time, to see whether it keeps
// the camera's rate, and whether latency and memory remain constant. The frames of a log, enlarged to the
// camera's size and compressed as by a camera, are played forward and backward, so that they form one
// uninterrupted scan of any length.

#include <turbojpeg.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

using Clock = std::chrono::steady_clock;
using Jpeg = std::vector<std::uint8_t>;

struct SoakArguments {
  std::string log, model, run_folder;
  double minutes = 10, rate_hz = 25;
};

constexpr int kSoakFrames = 120;            // Frames of the log after the background.
constexpr double kCameraNoiseLevels = 2.0;  // of the camera

/// Inverts the crop of camera images: the image becomes the middle 5/7 of a larger one, whose border is not
/// used.
cv::Mat3b enlarged(const cv::Mat3b& picture, const SensorProfile& profile) {
  const int border_x = profile.raw_width_px / 7, border_y = profile.raw_height_px / 7;
  const cv::Size middle(profile.raw_width_px - 2 * border_x, profile.raw_height_px - 2 * border_y);
  cv::Mat3b large;
  cv::resize(picture, large, middle, 0, 0, cv::INTER_CUBIC);
  cv::copyMakeBorder(large, large, border_y, border_y, border_x, border_x, cv::BORDER_REPLICATE);
  return large;
}

/// Adds noise before compression, because the noise of a camera determines the decoding time of a JPEG.
Jpeg compressed(const cv::Mat3b& picture, cv::RNG& random) {
  cv::Mat noise(picture.size(), CV_16SC3);
  random.fill(noise, cv::RNG::NORMAL, 0, kCameraNoiseLevels);
  cv::Mat sum;
  cv::add(picture, noise, sum, cv::noArray(), CV_8UC3);
  const std::unique_ptr<void, int (*)(tjhandle)> compressor(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  if (tjCompress2(compressor.get(), sum.data, sum.cols, 0, sum.rows, TJPF_BGR, &bytes, &size, TJSAMP_422, 85,
                  0) != 0)
    throw Error("a picture could not be compressed");
  Jpeg jpeg(bytes, bytes + size);
  tjFree(bytes);
  return jpeg;
}

std::vector<Jpeg> camera_pictures(const SoakArguments& arguments, const Config& config) {
  const std::unique_ptr<RawFrameSource> log = open_raw_log(arguments.log, config.sensor);
  FrameDecoder decoder(config.sensor);
  cv::RNG random(7);
  std::vector<Jpeg> pictures;
  while (static_cast<int>(pictures.size()) < kSoakFrames + config.background_frames) {
    const std::optional<RawFrame> frame = log->next();
    if (!frame) break;
    if (const std::optional<TactileImage> image = decoder.decode(*frame))
      pictures.push_back(compressed(enlarged(image->bgr, config.sensor), random));
  }
  if (static_cast<int>(pictures.size()) < config.background_frames + 2)
    throw Error(arguments.log + ": too few frames");
  return pictures;
}

/// Plays the images forward and backward without end.
class EndlessCamera : public RawFrameSource {
 public:
  EndlessCamera(std::vector<Jpeg> pictures, int background_frames, const SensorProfile& profile,
                double rate_hz)
      : pictures_(std::move(pictures)),
        background_(static_cast<std::size_t>(background_frames)),
        profile_(profile),
        rate_hz_(rate_hz) {}

  std::optional<RawFrame> next() override {
    RawFrame frame;
    frame.bytes = pictures_[picture_of(static_cast<std::size_t>(index_))];
    frame.width_px = profile_.raw_width_px;
    frame.height_px = profile_.raw_height_px;
    frame.time_s = static_cast<double>(index_) / rate_hz_;
    frame.index = frame.sequence = index_++;
    return frame;
  }
  void stop() override {}
  double rate_hz() const override { return rate_hz_; }
  std::string description() const override { return "a log played to and fro as full-size JPEG"; }

 private:
  std::size_t picture_of(std::size_t index) const {
    if (index < background_) return index;
    const std::size_t count = pictures_.size() - background_;
    const std::size_t phase = (index - background_) % (2 * count - 2);
    return background_ + (phase < count ? phase : 2 * count - 2 - phase);
  }

  const std::vector<Jpeg> pictures_;
  const std::size_t background_;
  const SensorProfile profile_;
  const double rate_hz_;
  std::int64_t index_ = 0;
};

/// Returns the current state of the scan as a row of the table.
Json row_of(double minute, const LiveStatus& s) {
  return {{"minute", minute},     {"rate_hz", s.rate_hz},       {"latency_ms", s.latency_ms},
          {"dropped", s.dropped}, {"frames", s.frames},         {"keyframes", s.keyframes},
          {"loops", s.loops},     {"components", s.components}, {"memory_mb", s.memory_mb}};
}

/// Returns six rows per minute while the scan runs.
Json watch(LiveSession& session, double for_minutes) {
  const Clock::time_point start = Clock::now();
  const auto minutes = [&] { return std::chrono::duration<double>(Clock::now() - start).count() / 60; };
  Json rows = Json::array();
  std::uint64_t version = 0;
  for (double next = 1.0 / 6; minutes() < for_minutes; next += 1.0 / 6) {
    std::this_thread::sleep_until(
        start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(60 * next)));
    version = session.mesh()->since(version, SIZE_MAX).version;  // As a window does.
    rows.push_back(row_of(minutes(), session.status()));
    std::cerr << rows.back().dump() << "\n";
  }
  return rows;
}

void run(const SoakArguments& arguments) {
  LiveOptions options;
  options.config = resolve_config({arguments.log, {}, arguments.model, {}, false});
  options.run_folder = arguments.run_folder;
  options.overwrite = true;
  options.mesh_feed = std::make_shared<MeshFeed>();
  if (!arguments.run_folder.empty()) options.record = attachments_of(options.config);
  const SensorProfile& profile = options.config.sensor;
  std::cerr << "compressing pictures of " << profile.raw_width_px << "x" << profile.raw_height_px << "\n";
  std::vector<Jpeg> pictures = camera_pictures(arguments, options.config);
  auto camera = std::make_unique<EndlessCamera>(std::move(pictures), options.config.background_frames,
                                                profile, arguments.rate_hz);
  const auto session = begin_live_scan(pace(std::move(camera)), options);
  const Json rows = watch(*session, arguments.minutes);
  const Clock::time_point stop = Clock::now();
  session->stop();
  session->wait();
  print_csv(rows);
  std::cerr << "stopped and saved in " << std::chrono::duration<double>(Clock::now() - stop).count()
            << " s\n";
}

}  // namespace

void add_soak(CLI::App& lab) {
  const auto arguments = std::make_shared<SoakArguments>();
  CLI::App* command = add_study(
      lab, "soak", "Run the live chain on full-size camera pictures: rate, latency and memory over time",
      arguments, run);
  command->add_option("LOG", arguments->log, "Log or data folder whose frames are played to and fro")
      ->required();
  command->add_option("--model", arguments->model, "Gradient model (default: the one the log names)");
  command->add_option("--minutes", arguments->minutes, "Duration")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--rate", arguments->rate_hz, "Frames per second")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("-o,--output", arguments->run_folder,
                      "Also record and save into this run folder (replaced)");
  command->footer("Example: gelslam-lab soak DATA/sequences/track_coin --minutes 10");
}

}  // namespace gelslam::lab
