// The window of `gelslam calibrate collect`, drawn into pictures without a display.
#include "windows/collect_window.hpp"

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "scene_fixture.hpp"
#include "temporary_folder.hpp"

namespace gelslam::test {
namespace {

using testing::Contains;
using namespace viewer;
using Loop = calibration::detail::CollectWindow;

class FakePresses final : public CollectWatch {
 public:
  FakePresses() {
    shown.bgr = cv::Mat3b(240, 320, cv::Vec3b(90, 80, 70));
    shown.coverage = PressCoverage({320, 240}, 18);
    for (const double place : {20.0, 30.0, 230.0}) shown.coverage.add({place, place, 10.0});
    shown.headline = "Hold it still";
    shown.warning = "the ball slides";
  }
  CollectView view() const override { return shown; }
  void take_back() override { ++taken_back; }

  CollectView shown;
  int taken_back = 0;
};

class CollectWindow : public SceneDrawing {
 protected:
  void SetUp() override {
    SceneDrawing::SetUp();
    options.visible = false;
    options.width_px = 1000;
    options.height_px = 700;
  }
  static void press_key(Loop& loop, int key) { loop.host().push({InputEvent::Kind::key, key, true}); }

  FakePresses session;
  CollectWindowOptions options;
};

TEST_F(CollectWindow, SaysWhatToDoAndWherePressesAreMissing) {
  Loop loop(session, options);
  loop.turn(1);
  EXPECT_FALSE(loop.wants_to_close());
  std::vector<std::string> words;
  for (const DrawnText& text : loop.texts()) words.push_back(text.text);
  for (const char* expected : {"3 of 18", "Hold it still", "the ball slides", "2 more", "1 more", "2"})
    EXPECT_THAT(words, Contains(expected));
  EXPECT_EQ(std::count(words.begin(), words.end(), "2 more"), 7);
  session.shown.warning.clear();
  loop.turn(2);
  EXPECT_TRUE(std::none_of(loop.texts().begin(), loop.texts().end(),
                           [](const DrawnText& text) { return text.text == "the ball slides"; }));
}

TEST_F(CollectWindow, KeysTakeBackAndEnd) {
  Loop loop(session, options);
  press_key(loop, GLFW_KEY_U);
  loop.turn(1);
  EXPECT_EQ(session.taken_back, 1);
  EXPECT_FALSE(loop.wants_to_close());
  press_key(loop, GLFW_KEY_Q);
  loop.turn(2);
  EXPECT_TRUE(loop.wants_to_close());
  Loop another(session, options);
  session.shown.closes = true;
  another.turn(1);
  EXPECT_TRUE(another.wants_to_close());
}

TEST_F(CollectWindow, LeavesASnapshotAndBearsASessionWithoutAPicture) {
  const TemporaryFolder folder;
  options.snapshot = folder / "window.png";
  session.shown.closes = true;
  run_collect_window(session, options);
  EXPECT_EQ(cv::imread((folder / "window.png").string()).size(), cv::Size(1000, 700));
  options.snapshot = folder / "empty.png";
  session.shown = {};
  write_collect_snapshot(session, options);
  EXPECT_FALSE(cv::imread((folder / "empty.png").string()).empty());
}

TEST_F(CollectWindow, DrawsTheCircleWhereItWasFound) {
  Loop loop(session, options);
  loop.turn(1);
  const cv::Mat3b plain = loop.picture(1.1);
  session.shown.circle = ContactCircle{160.0, 110.0, 30.0};
  loop.turn(2);
  const cv::Mat3b circled = loop.picture(2.1);
  cv::Mat1b changed(plain.size());
  std::transform(plain.begin(), plain.end(), circled.begin(), changed.begin(),
                 [](const cv::Vec3b& a, const cv::Vec3b& b) { return a == b ? 0 : 255; });
  const cv::Rect ring = cv::boundingRect(changed);
  const Box place = loop.view().largest(0.75F);  // of the picture
  const double scale = static_cast<double>(place.width) / 320;
  EXPECT_NEAR(ring.x + 0.5 * ring.width, place.x + 160.5 * scale, 1.0);
  EXPECT_NEAR(ring.y + 0.5 * ring.height, place.y + 110.5 * scale, 1.0);
  EXPECT_NEAR(ring.width, 60 * scale, 5.0);
  EXPECT_EQ(changed(ring.y + ring.height / 2, ring.x + ring.width / 2), 0) << "within";
}

}  // namespace
}  // namespace gelslam::test
