// The window of `gelslam calibrate collect`, drawn into pictures without a display.
#include "windows/press_window.hpp"

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "scene_fixture.hpp"
#include "temporary_folder.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using namespace viewer;
using calibration::detail::PressLayout;
using Loop = calibration::detail::PressWindow;

/// Four presses (discs on a gray gel) in a folder, found where they are, but for the last one.
LabelSession four_presses(const std::filesystem::path& folder) {
  PressSet set;
  set.folder = folder;
  set.background = cv::Mat3b(120, 160, cv::Vec3b(90, 100, 110));
  std::vector<FoundCircle> found;
  for (int k = 0; k < 4; ++k) {
    const cv::Point center(60 + 10 * k, 50);
    cv::Mat3b bgr = set.background.clone();
    cv::circle(bgr, center, 20, cv::Scalar(60, 100, 150), cv::FILLED);
    const std::string name = "p" + std::to_string(k);
    std::filesystem::create_directories(folder / name);
    set.presses.push_back({name, 9.5, bgr, std::nullopt});
    found.push_back({{static_cast<double>(center.x), 50.0, 20.0}, 0.95, ""});
  }
  found.back().problem = "the contact is too small";
  return {set, found};
}

class PressWindow : public SceneDrawing {
 protected:
  void SetUp() override {
    SceneDrawing::SetUp();
    if (IsSkipped()) return;
    options.visible = false;
    options.width_px = 1000;
    options.height_px = 700;
    options.picture_folder = folder.path();
  }
  static void press_key(Loop& loop, int key, double now_s) {
    loop.host().push({InputEvent::Kind::key, key, true});
    loop.host().push({InputEvent::Kind::key, key, false});
    loop.turn(now_s);
  }
  /// Presses the left button at a place of the press's picture and lets it go at another.
  static void drag(Loop& loop, const cv::Point2d& from, const cv::Point2d& to, double now_s) {
    const PressLayout layout = loop.layout();
    const auto pointer = [&](const cv::Point2d& at) {
      return InputEvent{InputEvent::Kind::pointer, 0, false, static_cast<double>(layout.x_of(at.x)),
                        static_cast<double>(layout.y_of(at.y))};
    };
    loop.host().push(pointer(from));
    loop.host().push({InputEvent::Kind::button, GLFW_MOUSE_BUTTON_LEFT, true});
    loop.turn(now_s);
    loop.host().push(pointer(0.5 * (from + to)));
    loop.turn(now_s + 0.01);
    loop.host().push(pointer(to));
    loop.host().push({InputEvent::Kind::button, GLFW_MOUSE_BUTTON_LEFT, false});
    loop.turn(now_s + 0.02);
  }

  TemporaryFolder folder;
  LabelSession session = four_presses(folder.path());
  PressWindowOptions options;
};

TEST_F(PressWindow, TheCircleLiesOnTheContact) {
  Loop loop(session, nullptr, options);
  loop.turn(1);
  session.show(1);  // p0: disc of radius 20 about (60, 50)
  const cv::Mat3b picture = loop.picture(1.1);
  const PressLayout& layout = loop.layout();
  const auto color_at = [&](double u, double v) {
    return picture(cvRound(layout.y_of(v)), cvRound(layout.x_of(u)));
  };
  EXPECT_NEAR(color_at(52, 44)[2], 150, 6) << "inside: the disc";
  EXPECT_NEAR(color_at(60, 90)[2], 110, 6) << "outside: the gel";
  for (const double angle : {0.3, 1.9, 3.6, 5.2}) {
    int brightest = 0;  // a line two pixels wide
    for (const double r : {19.75, 20.0, 20.25})
      brightest = std::max<int>(brightest, color_at(60 + r * std::cos(angle), 50 + r * std::sin(angle))[1]);
    EXPECT_GT(brightest, 170) << "its rim is white";
  }
}

TEST_F(PressWindow, TheMouseMovesTheCenterAndTheRim) {
  Loop loop(session, nullptr, options);
  loop.turn(1);
  session.show(1);
  drag(loop, {62, 48}, {70, 54}, 1.1);
  EXPECT_NEAR(session.label().circle.u_px, 68.0, 0.05);
  EXPECT_NEAR(session.label().circle.v_px, 56.0, 0.05);
  EXPECT_EQ(session.label().circle.radius_px, 20.0);
  drag(loop, {68 + 20, 56}, {68 + 26, 56}, 1.2);
  EXPECT_NEAR(session.label().circle.radius_px, 26.0, 0.05);
  EXPECT_NEAR(session.label().circle.u_px, 68.0, 0.05);
  loop.host().push({InputEvent::Kind::scroll, 0, false, 0, -4});
  loop.turn(1.3);
  EXPECT_NEAR(session.label().circle.radius_px, 24.0, 0.05);
}

TEST_F(PressWindow, KeysMoveAcceptLeaveOutAndGoBack) {
  Loop loop(session, nullptr, options);
  loop.turn(1);
  press_key(loop, GLFW_KEY_X, 1.1);  // p3
  press_key(loop, GLFW_KEY_RIGHT, 1.2);
  press_key(loop, GLFW_KEY_DOWN, 1.3);
  press_key(loop, GLFW_KEY_EQUAL, 1.4);
  EXPECT_EQ(session.press().name, "p0");
  EXPECT_EQ(session.label().circle.u_px, 60.5);
  EXPECT_EQ(session.label().circle.v_px, 50.5);
  EXPECT_EQ(session.label().circle.radius_px, 20.5);
  press_key(loop, GLFW_KEY_SPACE, 1.5);
  press_key(loop, GLFW_KEY_BACKSPACE, 1.6);
  EXPECT_EQ(session.press().name, "p0");
  press_key(loop, GLFW_KEY_A, 1.7);
  EXPECT_EQ(session.progress(), "3 of 4 accepted, 1 left out");
  press_key(loop, GLFW_KEY_Q, 1.8);
  EXPECT_TRUE(loop.controls().wants_to_close());
  EXPECT_EQ(read_label(folder / "p0/label.npz").radius_px, 20.5);
  EXPECT_TRUE(std::filesystem::exists(folder / "p3/left_out.npz"));
}

TEST_F(PressWindow, QThatCannotSaveStaysOpenUntilItCan) {
  Loop loop(session, nullptr, options);
  loop.turn(1);
  press_key(loop, GLFW_KEY_A, 1.1);
  std::filesystem::remove_all(folder / "p0");
  press_key(loop, GLFW_KEY_Q, 1.2);
  EXPECT_FALSE(loop.controls().wants_to_close());
  EXPECT_THAT(words_of(loop), Contains(testing::AllOf(HasSubstr("1 of 3 presses could not be saved"),
                                                      HasSubstr("p0"), HasSubstr("Q tries again"))));
  EXPECT_TRUE(std::filesystem::exists(folder / "p1/label.npz"));
  loop.turn(20);
  EXPECT_FALSE(loop.controls().toasts().empty()) << "long enough to be read";
  press_key(loop, GLFW_KEY_N, 20.1);  // something else: the person stayed
  press_key(loop, GLFW_KEY_Q, 20.2);
  EXPECT_FALSE(loop.controls().wants_to_close());
  std::filesystem::create_directory(folder / "p0");
  press_key(loop, GLFW_KEY_Q, 20.3);
  EXPECT_TRUE(loop.controls().wants_to_close());
  EXPECT_TRUE(std::filesystem::exists(folder / "p0/label.npz"));
}

/// A camera that shows a picture, and hands out presses.
class FakeCamera final : public CollectWatch {
 public:
  FakeCamera() {
    shown.bgr = cv::Mat3b(240, 320, cv::Vec3b(90, 80, 70));
    shown.background = shown.bgr;
    shown.coverage = PressCoverage({320, 240}, 18);
    for (const double place : {20.0, 30.0, 230.0}) shown.coverage.add({place, place, 10.0});
    shown.headline = "Hold it still";
    shown.warning = "the ball slides";
  }
  CollectView view() const override { return shown; }
  std::vector<TakenPress> taken() override { return std::exchange(taken_now, {}); }
  void count(const std::vector<ContactCircle>& contacts) override { counted = contacts; }
  double diameter_mm() const override { return 6.0; }

  CollectView shown;
  std::vector<TakenPress> taken_now;
  std::vector<ContactCircle> counted;
};

class CameraWindow : public PressWindow {
 protected:
  void take(const std::string& name) {
    std::filesystem::create_directories(folder / name);
    write_label(folder / name / "label.npz", {120.0, 80.0, 20.0});
    camera.taken_now.push_back({{name, 6.0, camera.shown.bgr, std::nullopt}, {{120.0, 80.0, 20.0}, 0.9, ""}});
  }

  FakeCamera camera;
  LabelSession collected{{folder.path(), {}, {}}, {}};
};

TEST_F(CameraWindow, PressesAreCorrectedAndLeftOutWhileTheyAreCollected) {
  Loop loop(collected, &camera, options);
  take("p0");
  take("p1");
  loop.turn(1);
  EXPECT_TRUE(loop.controls().shows_camera()) << "what comes does not disturb";
  EXPECT_EQ(camera.counted.size(), 2U);
  press_key(loop, GLFW_KEY_BACKSPACE, 1.1);
  EXPECT_EQ(collected.press().name, "p1");
  press_key(loop, GLFW_KEY_X, 1.2);
  EXPECT_TRUE(loop.controls().shows_camera()) << "none is open";
  EXPECT_EQ(camera.counted.size(), 1U) << "another one is wanted";
  press_key(loop, GLFW_KEY_BACKSPACE, 1.3);
  press_key(loop, GLFW_KEY_BACKSPACE, 1.4);
  press_key(loop, GLFW_KEY_RIGHT, 1.5);
  EXPECT_EQ(collected.press().name, "p0");
  press_key(loop, GLFW_KEY_N, 1.6);
  press_key(loop, GLFW_KEY_N, 1.7);
  EXPECT_TRUE(loop.controls().shows_camera());
  press_key(loop, GLFW_KEY_Q, 1.8);
  EXPECT_TRUE(loop.controls().wants_to_close());
  EXPECT_EQ(read_label(folder / "p0/label.npz").u_px, 120.5);
  EXPECT_TRUE(std::filesystem::exists(folder / "p1/left_out.npz"));
}

TEST_F(CameraWindow, DrawsTheCircleWhereItWasFound) {
  Loop loop(collected, &camera, options);
  loop.turn(1);
  const cv::Mat3b plain = loop.picture(1.1);
  camera.shown.circle = ContactCircle{160.0, 110.0, 30.0};
  loop.turn(2);
  const cv::Mat3b circled = loop.picture(2.1);
  cv::Mat1b changed(plain.size());
  std::transform(plain.begin(), plain.end(), circled.begin(), changed.begin(),
                 [](const cv::Vec3b& a, const cv::Vec3b& b) { return a == b ? 0 : 255; });
  const cv::Rect ring = cv::boundingRect(changed);
  const PressLayout& layout = loop.layout();
  EXPECT_NEAR(ring.x + 0.5 * ring.width, layout.x_of(160.0), 1.0);
  EXPECT_NEAR(ring.y + 0.5 * ring.height, layout.y_of(110.0), 1.0);
  EXPECT_NEAR(ring.width, 60 * layout.enlargement, 5.0);
  EXPECT_EQ(changed(ring.y + ring.height / 2, ring.x + ring.width / 2), 0) << "within";
}

}  // namespace
}  // namespace gelslam::test
