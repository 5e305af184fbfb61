#include <GLFW/glfw3.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fake_session.hpp"
#include "live/live_window.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

using namespace viewer;
using namespace viewer::detail;
using testing::IsEmpty;

class Controls : public testing::Test {
 protected:
  Controls() { session_.advance(); }
  void press(int key) { controls_.press_key(key, 0); }
  std::string newest_toast() const {
    return controls_.toasts().empty() ? "" : controls_.toasts().back().text;
  }

  std::string question() const { return controls_.question() ? controls_.question()->title : ""; }
  void ask_to_close() { controls_.perform(Action::close, 0); }

  FakeSession session_{1};
  LiveControls controls_{session_, true, "RUN-2"};
};

TEST_F(Controls, StopAndNewScanAskFirst) {
  press(GLFW_KEY_Q);
  EXPECT_EQ(question(), "Stop the scan?");
  press(GLFW_KEY_ESCAPE);
  press(GLFW_KEY_N);
  EXPECT_EQ(question(), "Start a new scan?");
  press(GLFW_KEY_N);  // no
  EXPECT_THAT(session_.calls, IsEmpty());
  EXPECT_FALSE(controls_.wants_new_scan());
  press(GLFW_KEY_ESCAPE);  // asks like Q
  press(GLFW_KEY_Y);
  EXPECT_THAT(session_.calls, ElementsAre("stop"));
  EXPECT_FALSE(controls_.wants_to_close()) << "the window stays until all is saved";
}

TEST_F(Controls, ANewScanFinishesThisOne) {
  press(GLFW_KEY_N);
  EXPECT_THAT(controls_.question()->sentence, testing::HasSubstr("RUN-2"));
  press(GLFW_KEY_ENTER);
  EXPECT_THAT(session_.calls, ElementsAre("stop"));
  EXPECT_TRUE(controls_.wants_new_scan());
  ask_to_close();  // it is being saved
  press(GLFW_KEY_ENTER);
  EXPECT_TRUE(controls_.wants_to_close());
  EXPECT_FALSE(controls_.wants_new_scan()) << "who closes the window wants no other scan";
}

TEST_F(Controls, ANewScanMayBeginOnceThisOneIsFinishedAndNeedsACamera) {
  session_.say(LivePhase::finished, "");
  LiveControls without_camera(session_);
  without_camera.press_key(GLFW_KEY_N, 0);
  EXPECT_TRUE(without_camera.toasts().back().trouble);
  EXPECT_FALSE(without_camera.wants_to_close());
  press(GLFW_KEY_N);
  EXPECT_TRUE(controls_.wants_to_close());
  EXPECT_TRUE(controls_.wants_new_scan());
}

TEST_F(Controls, KeysDoNothingElseWhileADialogAsks) {
  press(GLFW_KEY_Q);
  for (const int key : {GLFW_KEY_SPACE, GLFW_KEY_P, GLFW_KEY_T}) press(key);
  EXPECT_THAT(session_.calls, IsEmpty());
  EXPECT_FALSE(controls_.take_screenshot());
  EXPECT_FALSE(controls_.style().trajectory);
  EXPECT_EQ(question(), "Stop the scan?");
}

TEST_F(Controls, ClosingDependsOnThePhase) {
  ask_to_close();
  EXPECT_EQ(question(), "Stop the scan?");
  press(GLFW_KEY_ENTER);
  ask_to_close();
  EXPECT_EQ(question(), "Close the window?");
  press(GLFW_KEY_ESCAPE);
  EXPECT_FALSE(controls_.wants_to_close());
  session_.say(LivePhase::finished, "");
  ask_to_close();
  EXPECT_TRUE(controls_.wants_to_close());
}

TEST_F(Controls, NothingReachesASessionThatIsOver) {
  session_.say(LivePhase::finished, "");
  press(GLFW_KEY_SPACE);
  EXPECT_TRUE(newest_toast().starts_with("The scan is over")) << newest_toast();
  EXPECT_THAT(session_.calls, IsEmpty());
  EXPECT_EQ(question(), "");
}

TEST_F(Controls, NoKeyMeansTwoThings) { expect_keys_of_one_meaning(controls_.rows()); }

}  // namespace
}  // namespace gelslam::test
