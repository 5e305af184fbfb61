#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "browse/view_window.hpp"
#include "window_pictures.hpp"

namespace gelslam::viewer::detail {
namespace {

/// Keyframes at 10, 12, 14 s, poses from 10 to 50 s.
RunHistory history() {
  RunHistory result;
  for (int k = 0; k < 3; ++k) result.keyframes.push_back({10.0 + 2 * k, {}});
  for (int i = 0; i <= 40; ++i) result.trajectory.push_back({10.0 + i, Pose::Identity()});
  return result;
}

TEST(ViewControls, TheSliderRunsFromTheStartToTheSavedRun) {
  const RunHistory run = history();
  ViewControls controls(&run, false, {}, std::nullopt);
  EXPECT_EQ(controls.share(), 1) << "as saved";
  controls.seek(0.25);
  EXPECT_DOUBLE_EQ(*controls.time_s(), 20);
  EXPECT_DOUBLE_EQ(controls.share(), 0.25);
  controls.seek(-3);
  EXPECT_DOUBLE_EQ(*controls.time_s(), 10);
  controls.seek(2);
  EXPECT_FALSE(controls.time_s());
  controls.seek(std::nan(""));
  EXPECT_FALSE(controls.time_s());
}

TEST(ViewControls, ArrowsGoKeyframeByKeyframeAndTheEndIsTheSavedRun) {
  const RunHistory run = history();
  ViewControls controls(&run, false, {}, std::nullopt);
  const auto after = [&](int key) {
    controls.press_key(key, 0);
    return controls.time_s().value_or(-1);
  };
  EXPECT_EQ(after(GLFW_KEY_LEFT), 14);
  EXPECT_EQ(after(GLFW_KEY_LEFT), 12);
  EXPECT_EQ(after(GLFW_KEY_LEFT), 10);
  EXPECT_EQ(after(GLFW_KEY_LEFT), 10);
  EXPECT_EQ(after(GLFW_KEY_RIGHT), 12);
  EXPECT_EQ(after(GLFW_KEY_RIGHT), 14);
  EXPECT_EQ(after(GLFW_KEY_RIGHT), -1);
}

TEST(ViewControls, PlayingEndsAtTheSavedRunWithinTwentySeconds) {
  const RunHistory run = history();
  ViewControls controls(&run, false, {}, std::nullopt);
  EXPECT_FALSE(controls.advance(1));
  controls.press_key(GLFW_KEY_SPACE, 0);
  EXPECT_DOUBLE_EQ(*controls.time_s(), 10) << "from the start";
  double played_s = 0;
  while (controls.advance(0.02) && controls.plays()) played_s += 0.02;
  EXPECT_NEAR(played_s, 20, 0.1);
  EXPECT_FALSE(controls.time_s());
  controls.press_key(GLFW_KEY_SPACE, 0);
  controls.advance(1);
  controls.press_key(GLFW_KEY_SPACE, 0);
  const auto rests_at = controls.time_s();
  EXPECT_FALSE(controls.advance(1));
  EXPECT_EQ(controls.time_s(), rests_at);
}

TEST(ViewControls, WithoutHistoryTimeDoesNothing) {
  ViewControls controls(nullptr, false, {}, 7.0);
  EXPECT_FALSE(controls.time_s());
  for (const int key : {GLFW_KEY_SPACE, GLFW_KEY_LEFT, GLFW_KEY_RIGHT}) controls.press_key(key, 0);
  controls.seek(0.5);
  EXPECT_FALSE(controls.advance(1));
  EXPECT_FALSE(controls.time_s());
}

TEST(ViewControls, ColorsAreThoseThatMeanSomething) {
  const RunHistory run = history();
  const auto seen = [](const RunHistory* history, bool has_second) {
    ViewControls controls(history, has_second, {}, {});
    std::set<SceneColor> colors;
    for (int i = 0; i < 10; ++i) {
      controls.press_key(GLFW_KEY_C, 0);
      colors.insert(controls.style().color);
    }
    return colors;
  };
  using enum SceneColor;
  EXPECT_EQ(seen(nullptr, false), (std::set{plain, confidence, height}));
  EXPECT_EQ(seen(&run, false), (std::set{plain, confidence, height}));
  EXPECT_EQ(seen(&run, true), (std::set{plain, confidence, height, distance}));
}

TEST(ViewControls, NoKeyMeansTwoThings) {
  const RunHistory run = history();
  test::expect_keys_of_one_meaning(ViewControls(&run, true, {}, {}).rows());
}

}  // namespace
}  // namespace gelslam::viewer::detail
