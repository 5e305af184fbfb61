#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <set>
#include <thread>

#include "../sensor/raw_frames.hpp"
#include "../support/temporary_folder.hpp"
#include "../surface/linear_gel.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/slam/live_slam.hpp"

namespace gelslam::test {

inline constexpr int kBackgroundFrames = 10, kScanFrames = 50;

/// Returns pictures of ten bare frames, followed by a peanut that wobbles under the sensor.
inline const std::vector<cv::Mat3b>& peanut_pictures() {
  static const std::vector<cv::Mat3b> pictures = [] {
    ScanSpec spec;
    spec.object.name = "peanut";
    spec.motion.frames = kScanFrames;
    spec.background_frames = kBackgroundFrames;
    const Simulator simulator(spec);
    std::vector<cv::Mat3b> result;
    for (int i = 0; i < simulator.frame_count(); ++i)
      result.push_back(render(simulator.frame(i).height_mm, SensorProfile{}.pixel_pitch_mm, 1.0,
                              static_cast<std::uint64_t>(i)));
    return result;
  }();
  return pictures;
}

/// A source that delivers pictures as fast as they are read. Before some of them, it calls a given function.
class Pictures : public RawFrameSource {
 public:
  explicit Pictures(std::vector<cv::Mat3b> pictures) : pictures_(std::move(pictures)) {}

  std::optional<RawFrame> next() override {
    open_.wait(false);
    if (stopped_ || next_ >= pictures_.size()) return std::nullopt;
    if (const auto found = before_.find(static_cast<int>(next_)); found != before_.end()) found->second();
    if (stopped_) return std::nullopt;
    RawFrame frame = bgr_frame(pictures_[next_], static_cast<std::int64_t>(next_));
    ++next_;
    frame.arrived = std::chrono::steady_clock::now();
    reconnects_ += resumed_.contains(frame.index);
    frame.reconnects = reconnects_;
    if (damaged_.contains(frame.index)) frame.bytes.resize(100);
    return frame;
  }
  void stop() override { stopped_ = true; }
  double rate_hz() const override { return 25.0; }
  std::string description() const override { return "a made-up camera"; }

  /// Starts the delivery. The source waits for this call, because the given functions need the session.
  void open() {
    open_ = true;
    open_.notify_all();
  }
  void before(int frame, std::function<void()> what) { before_[frame] = std::move(what); }
  void damage(int frame) { damaged_.insert(frame); }
  void resume(int frame) { resumed_.insert(frame); }

 private:
  std::vector<cv::Mat3b> pictures_;
  std::size_t next_ = 0;
  int reconnects_ = 0;
  std::atomic<bool> open_{false}, stopped_{false};
  std::map<int, std::function<void()>> before_;
  std::set<std::int64_t> damaged_, resumed_;
};

/// Waits until `condition` holds, and returns false if it does not hold within a minute.
inline bool comes_true(const std::function<bool()>& condition) {
  for (int i = 0; i < 6000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

class Live : public testing::Test {
 protected:
  Live() {
    write_pth_model(folder / "model.pth", linear_gel_model());
    options.config.sensor.calibration_model_path = folder / "model.pth";
    options.drop_when_behind = false;
    options.run_folder = folder / "run";
    options.mesh_feed = std::make_shared<MeshFeed>();
  }

  LiveSession& start() {
    Pictures& pictures = *source;
    session = begin_live_scan(std::move(source), options);
    pictures.open();
    return *session;
  }
  /// Prepares that start() continues the run of the session before.
  void continue_run() {
    session.reset();
    options.continued.reset();  // it still locks the folder if this is the second call
    options.continued = continue_in_place(options.run_folder, options.config);
    source = std::make_unique<Pictures>(peanut_pictures());
  }
  /// Waits, in the thread of the source, until the tracker has processed this frame.
  void wait_for_touch(std::int64_t index) {
    EXPECT_TRUE(comes_true([&] { return session->touch() && session->touch()->tracked.frame >= index; }));
  }
  std::string read(const fs::path& file) const { return read_bytes(options.run_folder / file); }

  TemporaryFolder folder;
  LiveOptions options;
  std::unique_ptr<Pictures> source = std::make_unique<Pictures>(peanut_pictures());
  std::unique_ptr<LiveSession> session;
};

}  // namespace gelslam::test
