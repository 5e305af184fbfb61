// The window of `gelslam calibrate collect`, drawn into pictures without a display.
#include "windows/collect_window.hpp"

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "scene_fixture.hpp"
#include "temporary_folder.hpp"

namespace gelslam::test {
namespace {

using testing::Contains;
using namespace viewer;
using calibration::detail::collect_picture;
using Loop = calibration::detail::CollectWindow;

class FakePresses final : public CollectWatch {
 public:
  FakePresses() {
    shown.bgr = cv::Mat3b(240, 320, cv::Vec3b(90, 80, 70));
    shown.taken = {2, 0, 0, 0, 0, 0, 0, 0, 1};
    shown.missing = {0, 2, 2, 2, 2, 2, 2, 2, 1};
    shown.presses = 3;
    shown.wanted = 18;
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
  session.shown.closes = false;
  options.script = "key u; key q";
  run_collect_window(session, options);
  EXPECT_EQ(session.taken_back, 2) << "a script instead of a person";
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

TEST(CollectPicture, DrawsTheCircleWhereItWasFound) {
  FakePresses session;
  const cv::Mat3b plain = collect_picture(session.view());
  session.shown.circle = ContactCircle{100.0, 50.0, 30.0};
  const cv::Mat3b circled = collect_picture(session.view());
  EXPECT_EQ(circled.size(), cv::Size(960, 720));
  EXPECT_NE(circled(151, 301 + 90), plain(151, 301 + 90));  // on the ring
  EXPECT_EQ(circled(151, 301 + 60), plain(151, 301 + 60));  // within
  session.shown.bgr.release();
  EXPECT_TRUE(collect_picture(session.view()).empty());
}

}  // namespace
}  // namespace gelslam::test
