// Tests scans that are continued, also after the program was killed, and what is saved in which folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "../sensor/fake_camera.hpp"
#include "../support/killed_process.hpp"
#include "camera_input.hpp"
#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/store.hpp"
#include "live_fixture.hpp"

namespace gelslam::test {
namespace {

/// Returns everything that a reader gets until the end of the feed.
std::string hear_all(LineFeed::Reader& reader) {
  std::string text;
  while (const auto lines = reader.next(std::chrono::steady_clock::now() + std::chrono::seconds(1)))
    text += *lines;
  return text;
}

TEST_F(Live, TheNextScanHasTheSameBackgroundAndALogThatStandsAlone) {
  options.record = LogAttachments{};
  const int keyframes = start().wait().keyframes;
  const BackgroundFrames background = session->background_frames();
  const std::string first_log = read("log.mkv");
  options.run_folder = folder / "run-2";
  auto pictures = std::make_unique<Pictures>(  // that touch from the first one on
      std::vector<cv::Mat3b>(peanut_pictures().begin() + kBackgroundFrames, peanut_pictures().end()));
  pictures->open();
  session = begin_live_scan(after_background(background, std::move(pictures)), options);
  const RunReport summary = session->wait();
  EXPECT_EQ(summary.keyframes, keyframes) << "the same pictures";
  EXPECT_EQ(summary.frames.total, kBackgroundFrames + kScanFrames);
  const auto log = open_raw_log(options.run_folder / "log.mkv", options.config.sensor);
  FrameDecoder decoder(options.config.sensor);
  double last_s = -1;
  int frames = 0;
  for (; const auto frame = log->next(); ++frames) {
    EXPECT_GT(frame->time_s, std::exchange(last_s, frame->time_s));
    if (frames >= kBackgroundFrames) continue;
    const cv::Mat3b logged = decoder.decode(*frame)->bgr,
                    given = decoder.decode(*background[static_cast<std::size_t>(frames)])->bgr;
    EXPECT_EQ(cv::norm(logged, given, cv::NORM_INF), 0) << frames;
  }
  EXPECT_EQ(frames, kBackgroundFrames + kScanFrames);
  EXPECT_EQ(log->lost_frames(), 0);
  EXPECT_TRUE(read_bytes(folder / "run/log.mkv") == first_log);
}

TEST_F(Live, AStreamShowsTheKeyframesOfTheScanThatGoesOn) {
  const int before = start().wait().keyframes;
  continue_run();
  options.stream = std::make_shared<LineFeed>();
  std::future<std::string> heard;
  source->before(30, [&] {
    auto reader = options.stream->open({.surface = true});
    heard = std::async(std::launch::async, [reader] { return hear_all(*reader); });
  });
  const int all = start().wait().keyframes;
  options.stream->close();
  std::set<int> ids;
  for (const std::string& line : lines_of(heard.get())) {
    const auto json = nlohmann::json::parse(line);
    if (json.at("type") != "keyframe") continue;
    EXPECT_TRUE(ids.insert(json.at("keyframe").get<int>()).second) << "one line each";
    EXPECT_GT(json.at("points").size(), 200u);
  }
  EXPECT_GT(before, 2);
  EXPECT_EQ(static_cast<int>(ids.size()), all);
}

/// This includes a scan that was killed while the background was recorded.
TEST_F(Live, AScanThatTouchedNothingGoesOn) {
  source = std::make_unique<Pictures>(std::vector<cv::Mat3b>(15, peanut_pictures().front()));
  EXPECT_EQ(start().wait().keyframes, 0);
  for (const bool killed : {false, true}) {
    if (killed) {
      const ScanPart part = options.continued->record.parts.front();
      session.reset();
      options.continued.reset();
      fs::remove_all(options.run_folder);
      fs::create_directories(options.run_folder);
      begin_store(options.run_folder, part);
    }
    continue_run();
    const RunReport summary = start().wait();
    EXPECT_GT(summary.frames.tracked, 40);
    EXPECT_EQ(summary.components, 1);
    EXPECT_TRUE(fs::exists(options.run_folder / "mesh.ply"));
  }
}

/// Runs a scan with a camera that disappears after all pictures. `tell` is called when the program searches
/// for it.
void scan_until_away(LiveOptions options, const std::function<void()>& tell) {
  FakeCamera camera;
  camera.modes = {{V4L2_PIX_FMT_MJPEG, 320, 240, {25}}};
  std::uint32_t sequence = 0;
  for (const cv::Mat3b& picture : peanut_pictures()) {
    camera.frames.push_back({.sequence = sequence, .time_s = 5000 + 0.04 * sequence});
    cv::imencode(".jpg", picture, camera.frames.back().bytes);
    ++sequence;
  }
  camera.frames.push_back({.code = ENODEV});
  detail::VideoSystem system = fake_system({&camera});
  system.nodes = [&] {
    camera.open_fails = ENODEV;
    tell();
    return std::vector{camera.path};
  };
  CameraOptions of_camera;
  of_camera.device = camera.path;
  of_camera.width_px = 320;
  of_camera.height_px = 240;
  of_camera.reconnect_timeout_s = 60;
  options.record = LogAttachments{};
  begin_live_scan(open_camera(of_camera, system), options)->wait();
}

TEST_F(Live, AKillWhileTheCameraIsAwayTakesNothing) {
  KilledProcess scan([&](const auto& tell) { scan_until_away(options, tell); });
  scan.wait_for_step();
  const auto recorded = [&] {
    const auto log = open_raw_log(options.run_folder / "log.mkv");
    std::size_t frames = 0;
    while (log->next()) ++frames;
    return frames;
  };
  EXPECT_TRUE(comes_true([&] { return recorded() == peanut_pictures().size(); }));
  EXPECT_TRUE(comes_true([&] { return !read_scan(options.run_folder, {}).keyframes.empty(); }));
  scan.kill();
  EXPECT_EQ(recorded(), peanut_pictures().size());
  continue_run();
  EXPECT_GT(start().wait().keyframes, 1) << "the scan goes on";
}

}  // namespace
}  // namespace gelslam::test
