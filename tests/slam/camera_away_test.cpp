// A live session that is killed while its camera is away.

#include <opencv2/imgcodecs.hpp>

#include "../sensor/fake_camera.hpp"
#include "../support/killed_process.hpp"
#include "cameras/v4l2_camera.hpp"
#include "gelslam/slam/store.hpp"
#include "live_fixture.hpp"

namespace gelslam {
namespace {

using test::Live;

/// Scans with a camera that is lost after all pictures; `tell` is called when it is looked for.
void scan_until_away(LiveOptions options, const std::function<void()>& tell) {
  test::FakeCamera camera;
  camera.modes = {{V4L2_PIX_FMT_MJPEG, 320, 240, {25}}};
  std::uint32_t sequence = 0;
  for (const cv::Mat3b& picture : test::peanut_pictures()) {
    camera.frames.push_back({.sequence = sequence, .time_s = 5000 + 0.04 * sequence});
    cv::imencode(".jpg", picture, camera.frames.back().bytes);
    ++sequence;
  }
  camera.frames.push_back({.code = ENODEV});
  detail::VideoSystem system = test::fake_system({&camera});
  system.nodes = [&] {
    camera.open_fails = ENODEV;
    tell();
    return std::vector{camera.path};
  };
  CameraOptions of_camera;
  of_camera.device = camera.path;
  of_camera.width_px = 320;
  of_camera.height_px = 240;
  of_camera.away_s = 60;
  options.record = LogAttachments{};
  begin_live_scan(open_camera(of_camera, system), options)->wait();
}

TEST_F(Live, AKillWhileTheCameraIsAwayTakesNothing) {
  test::KilledProcess scan([&](const auto& tell) { scan_until_away(options, tell); });
  scan.wait_for_step();
  const auto recorded = [&] {
    const auto log = open_raw_log(options.run_folder / "log.mkv");
    std::size_t frames = 0;
    while (log->next()) ++frames;
    return frames;
  };
  EXPECT_TRUE(test::comes_true([&] { return recorded() == test::peanut_pictures().size(); }));
  EXPECT_TRUE(test::comes_true([&] { return !read_scan(options.run_folder, {}).keyframes.empty(); }));
  scan.kill();
  EXPECT_EQ(recorded(), test::peanut_pictures().size());
  continue_run();
  EXPECT_GT(start().wait().keyframes, 1) << "the scan goes on";
}

}  // namespace
}  // namespace gelslam
