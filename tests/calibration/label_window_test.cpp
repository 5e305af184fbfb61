// The window of `gelslam calibrate label`, drawn into pictures without a display.
#include "windows/label_window.hpp"

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "label_presses.hpp"
#include "scene_fixture.hpp"
#include "temporary_folder.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using namespace viewer;
using calibration::detail::difference_picture;
using calibration::detail::LabelLayout;
using Loop = calibration::detail::LabelWindow;

class LabelWindow : public SceneDrawing {
 protected:
  void SetUp() override {
    SceneDrawing::SetUp();
    if (IsSkipped()) return;
    options.visible = false;
    options.width_px = 1000;
    options.height_px = 700;
    options.picture_folder = folder.path();
  }
  static std::vector<std::string> words(const Loop& loop) {
    std::vector<std::string> result;
    for (const DrawnText& text : loop.texts()) result.push_back(text.text);
    return result;
  }
  static void press_key(Loop& loop, int key, double now_s) {
    loop.host().push({InputEvent::Kind::key, key, true});
    loop.host().push({InputEvent::Kind::key, key, false});
    loop.turn(now_s);
  }
  /// Presses the left button at a place of the press's picture and lets it go at another.
  static void drag(Loop& loop, const cv::Point2d& from, const cv::Point2d& to, double now_s) {
    const LabelLayout layout = loop.layout();
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
  LabelWindowOptions options;
};

TEST_F(LabelWindow, ShowsTheDoubtfulPressFirst) {
  Loop loop(session, options);
  loop.turn(1);
  EXPECT_THAT(words(loop),
              testing::IsSupersetOf({"0 of 4 accepted, 1 doubtful", "p3: the contact is too small", "Accept",
                                     "Leave out", "Save and end", "Not decided"}));
}

TEST_F(LabelWindow, TheCircleLiesOnTheContact) {
  Loop loop(session, options);
  loop.turn(1);
  session.show(1);  // p0: disc of radius 20 about (60, 50)
  const cv::Mat3b picture = loop.picture(1.1);
  const LabelLayout& layout = loop.layout();
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

TEST_F(LabelWindow, TheMouseMovesTheCenterAndTheRim) {
  Loop loop(session, options);
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
  press_key(loop, GLFW_KEY_U, 1.4);
  press_key(loop, GLFW_KEY_U, 1.5);
  press_key(loop, GLFW_KEY_U, 1.6);
  EXPECT_EQ(session.label().circle.u_px, 60.0) << "three movements, three times undo";
  EXPECT_EQ(session.label().circle.radius_px, 20.0);
}

TEST_F(LabelWindow, KeysMoveAcceptLeaveOutAndGoBack) {
  Loop loop(session, options);
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
  press_key(loop, GLFW_KEY_S, 1.8);
  EXPECT_THAT(words(loop), Contains("4 presses saved"));
  EXPECT_EQ(read_label(folder / "p0/label.npz").radius_px, 20.5);
  EXPECT_TRUE(std::filesystem::exists(folder / "p3/left_out.npz"));
}

TEST_F(LabelWindow, AClickOnAMarkShowsThatPress) {
  Loop loop(session, options);
  loop.turn(1);
  const Box mark = loop.layout().mark(2, 4);
  loop.host().push({InputEvent::Kind::pointer, 0, false, static_cast<double>(mark.x + 0.5F * mark.width),
                    static_cast<double>(mark.y + 0.5F * mark.height)});
  loop.host().push({InputEvent::Kind::button, 0, true});
  loop.turn(1.1);
  EXPECT_EQ(session.current(), 2U);
}

TEST_F(LabelWindow, QSavesAndEnds) {
  Loop loop(session, options);
  loop.turn(1);
  press_key(loop, GLFW_KEY_D, 1.1);
  EXPECT_TRUE(loop.controls().shows_difference());
  press_key(loop, GLFW_KEY_A, 1.2);
  press_key(loop, GLFW_KEY_Q, 1.3);
  EXPECT_TRUE(loop.controls().wants_to_close());
  EXPECT_EQ(session.counts().accepted, 3U);
  EXPECT_TRUE(std::filesystem::exists(folder / "p0/label.npz"));
}

TEST_F(LabelWindow, TinyWindowsAndHelpDoNoHarm) {
  Loop loop(session, options);
  press_key(loop, GLFW_KEY_H, 1);
  double now_s = 1;
  for (const auto& [width, height] : {std::pair{300, 200}, {100, 100}, {1600, 1200}}) {
    loop.host().resize(width, height);
    for (int i = 0; i < 3; ++i) loop.turn(now_s += 0.05, true);
  }
  EXPECT_THAT(words(loop), Contains("Leave this press out"));
}

TEST_F(LabelWindow, ASnapshotWritesNoLabel) {
  write_label_snapshot(session, folder / "s.png", options);
  EXPECT_EQ(cv::imread((folder / "s.png").string()).size(), cv::Size(1000, 700));
  for (const char* press : {"p0", "p1", "p2", "p3"}) EXPECT_TRUE(std::filesystem::is_empty(folder / press));
}

TEST_F(LabelWindow, AFullDiskIsSaidInTheWindow) {
  Loop loop(session, options);
  loop.turn(1);
  press_key(loop, GLFW_KEY_A, 1.1);
  std::filesystem::remove_all(folder / "p0");
  press_key(loop, GLFW_KEY_S, 1.2);
  EXPECT_THAT(loop.controls().toasts().back().text, HasSubstr("p0"));
}

TEST_F(LabelWindow, QThatCannotSaveStaysOpenUntilItCan) {
  Loop loop(session, options);
  loop.turn(1);
  press_key(loop, GLFW_KEY_A, 1.1);
  std::filesystem::remove_all(folder / "p0");
  press_key(loop, GLFW_KEY_Q, 1.2);
  EXPECT_FALSE(loop.controls().wants_to_close());
  EXPECT_THAT(words(loop), Contains(testing::AllOf(HasSubstr("1 of 3 presses could not be saved"),
                                                   HasSubstr("p0"), HasSubstr("Q once more"))));
  EXPECT_TRUE(std::filesystem::exists(folder / "p1/label.npz"));
  loop.turn(20);
  EXPECT_FALSE(loop.controls().toasts().empty()) << "long enough to be read";
  press_key(loop, GLFW_KEY_D, 20.1);  // something else: the person stayed
  press_key(loop, GLFW_KEY_Q, 20.2);
  EXPECT_FALSE(loop.controls().wants_to_close());
  std::filesystem::create_directory(folder / "p0");
  press_key(loop, GLFW_KEY_Q, 20.3);
  EXPECT_TRUE(loop.controls().wants_to_close());
  EXPECT_EQ(loop.controls().written(), 3U);
  EXPECT_TRUE(std::filesystem::exists(folder / "p0/label.npz"));
}

TEST_F(LabelWindow, ASecondQLeavesAndSaysWhatIsLost) {
  session.accept_rest();
  std::filesystem::remove_all(folder / "p0");
  Loop loop(session, options);
  loop.host().push({InputEvent::Kind::key, GLFW_KEY_Q, true});
  loop.host().push({InputEvent::Kind::key, GLFW_KEY_Q, true});
  EXPECT_THAT(message_of<Error>([&] { loop.run_and_save(); }),
              testing::AllOf(HasSubstr("could not be saved"), HasSubstr("p0")));
  EXPECT_TRUE(std::filesystem::exists(folder / "p2/label.npz"));
}

TEST_F(LabelWindow, CtrlCSavesAndCloses) {
  session.accept_rest();
  int asked = 0;
  options.asks_to_end = [&] { return ++asked > 2; };
  EXPECT_EQ(run_label_window(session, options), 3U);
  EXPECT_TRUE(std::filesystem::exists(folder / "p0/label.npz"));
}

TEST(LabelPicture, StretchesTheDifferenceAndIgnoresTheExposure) {
  const cv::Mat3b bare(60, 80, cv::Vec3b(90, 100, 110));
  cv::Mat3b press = bare.clone();
  press += cv::Scalar(5, 5, 5);
  cv::circle(press, {40, 30}, 12, cv::Scalar(95, 125, 115), cv::FILLED);
  const cv::Mat3b picture = difference_picture(press, bare);
  EXPECT_EQ(picture(3, 3), cv::Vec3b(128, 128, 128));
  EXPECT_EQ(picture(30, 40)[0], 128);
  EXPECT_GT(picture(30, 40)[1], 240);
  EXPECT_EQ(difference_picture(bare, bare)(10, 10), cv::Vec3b(128, 128, 128));
}

}  // namespace
}  // namespace gelslam::test
