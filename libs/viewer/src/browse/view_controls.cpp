#include "browse/view_controls.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>

#include "scene/scene_actions.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double kLongestPlay_s = 20;
constexpr double kRightEnd = 0.999;  ///< of the slider: all of it is hard to hit

}  // namespace

const std::vector<KeyBinding<ViewAction>>& view_keys() {
  using enum ViewAction;
  static const std::vector<KeyBinding<ViewAction>> keys = {
      {play, GLFW_KEY_SPACE, 0, "Space", "Play, rest"},
      {step_back, GLFW_KEY_LEFT, 0, "Left", "One keyframe back"},
      {step_on, GLFW_KEY_RIGHT, 0, "Right", "One keyframe on"},
      {shading_lit, GLFW_KEY_1, GLFW_KEY_KP_1, "1", "Clay"},
      {shading_matcap, GLFW_KEY_2, GLFW_KEY_KP_2, "2", "Polished"},
      {shading_curvature, GLFW_KEY_3, GLFW_KEY_KP_3, "3", "Curvature"},
      {next_color, GLFW_KEY_C, 0, "C", "Colors by what is known"},
      {trajectory, GLFW_KEY_T, 0, "T", "Trajectory"},
      {pose_graph, GLFW_KEY_G, 0, "G", "Pose graph"},
      {grid, GLFW_KEY_M, 0, "M", "Millimetre grid"},
      {light_theme, GLFW_KEY_L, 0, "L", "Light or dark"},
      {show_all, GLFW_KEY_R, 0, "R", "Show all"},
      {screenshot, GLFW_KEY_P, 0, "P", "Picture of this window (PNG)"},
      {panels, GLFW_KEY_TAB, 0, "Tab", "Hide or show the panels"},
      {help, GLFW_KEY_H, GLFW_KEY_F1, "H", "This help"},
      {close, GLFW_KEY_Q, GLFW_KEY_ESCAPE, "Q", "Close"},
  };
  return keys;
}

ViewControls::ViewControls(const RunHistory* history, bool has_second, const SceneStyle& style,
                           std::optional<double> time_s)
    : history_(history),
      has_second_(has_second),
      style_(style),
      time_s_(history != nullptr ? time_s : std::nullopt) {}

void ViewControls::press_key(int key) {
  if (shows_help_ && key == GLFW_KEY_ESCAPE) {
    shows_help_ = false;
    return;
  }
  if (const auto action = action_of_key(view_keys(), key)) perform(*action);
}

void ViewControls::perform(ViewAction action) {
  using enum ViewAction;
  if (change_look(style_, action)) return;
  switch (action) {
    case play:
      return play_or_rest();
    case step_back:
      return step(-1);
    case step_on:
      return step(1);
    case next_color:
      return change_color();
    case light_theme:
      style_.light_theme = !style_.light_theme;
      return;
    case show_all:
      show_all_ = true;
      return;
    case screenshot:
      screenshot_ = true;
      return;
    case panels:
      shows_panels_ = !shows_panels_;
      return;
    case help:
      shows_help_ = !shows_help_;
      return;
    case close:
      wants_to_close_ = true;
      return;
    default:
      return;  // the look: changed above
  }
}

void ViewControls::change_color() {
  std::vector<SceneColor> known = {SceneColor::plain, SceneColor::confidence, SceneColor::height};
  if (has_time()) known.push_back(SceneColor::keyframe);
  if (has_second_) known.push_back(SceneColor::distance);
  style_.color = color_after(style_.color, known);
}

double ViewControls::share() const {
  if (!has_time() || !time_s_) return 1;
  const double length_s = history_->end_s() - history_->start_s();
  return length_s > 0 ? std::clamp((*time_s_ - history_->start_s()) / length_s, 0.0, 1.0) : 1;
}

void ViewControls::seek(double share) {
  if (!has_time() || std::isnan(share)) return;
  plays_ = false;
  time_s_.reset();
  if (share < kRightEnd) {
    time_s_ = history_->start_s() + std::max(share, 0.0) * (history_->end_s() - history_->start_s());
  }
}

void ViewControls::step(int keyframes) {
  if (!has_time()) return;
  plays_ = false;
  const auto& all = history_->keyframes;
  const double now_s = time_s_.value_or(history_->end_s());
  const auto after = std::upper_bound(all.begin(), all.end(), now_s,
                                      [](double t, const RunHistory::KeyframeAt& k) { return t < k.time_s; });
  const std::ptrdiff_t newest = after - all.begin() - 1;
  // Beyond the last keyframe lies the run as it was saved; back from there the last keyframe is the first
  // stop.
  const std::ptrdiff_t wanted = !time_s_ && keyframes < 0 ? newest : newest + keyframes;
  if (wanted >= static_cast<std::ptrdiff_t>(all.size())) {
    time_s_.reset();
  } else {
    time_s_ = all[static_cast<std::size_t>(std::max<std::ptrdiff_t>(wanted, 0))].time_s;
  }
}

void ViewControls::play_or_rest() {
  if (!has_time()) return;
  plays_ = !plays_;
  if (plays_ && !time_s_) time_s_ = history_->start_s();
}

bool ViewControls::advance(double dt_s) {
  if (!plays_ || !time_s_) return false;
  const double length_s = history_->end_s() - history_->start_s();
  *time_s_ += dt_s * std::max(1.0, length_s / kLongestPlay_s);
  if (*time_s_ >= history_->end_s()) {
    time_s_.reset();
    plays_ = false;
  }
  return true;
}

}  // namespace gelslam::viewer::detail
