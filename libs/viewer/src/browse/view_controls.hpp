#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"
#include "gelslam/viewer/view_content.hpp"
#include "ui/key_binding.hpp"

namespace gelslam::viewer::detail {

/// Everything a person can ask of the window of `gelslam view`.
enum class ViewAction {
  play,
  step_back,
  step_on,
  shading_lit,
  shading_matcap,
  shading_curvature,
  next_color,
  trajectory,
  pose_graph,
  grid,
  light_theme,
  show_all,
  screenshot,
  panels,
  help,
  close,
};

/// In the order of the help.
const std::vector<KeyBinding<ViewAction>>& view_keys();

/// What is shown and how, without a pixel of how it looks.
class ViewControls {
 public:
  /// `history` (or null: no time) must stay.
  ViewControls(const RunHistory* history, bool has_second, const SceneStyle& style,
               std::optional<double> time_s);

  void press_key(int key);
  void perform(ViewAction action);
  /// Place on the slider, 0 to 1; the right end is the run as it was saved.
  void seek(double share);
  /// Lets time go on while playing: all of a run in at most 20 s. True while it does.
  bool advance(double dt_s);

  bool has_time() const { return history_ != nullptr; }
  std::optional<double> time_s() const { return time_s_; }
  double share() const;
  bool plays() const { return plays_; }
  const SceneStyle& style() const { return style_; }
  bool shows_panels() const { return shows_panels_; }
  bool shows_help() const { return shows_help_; }
  bool wants_to_close() const { return wants_to_close_; }
  /// Each is handed out once.
  bool take_show_all() { return std::exchange(show_all_, false); }
  bool take_screenshot() { return std::exchange(screenshot_, false); }

 private:
  void change_color();
  void step(int keyframes);
  void play_or_rest();

  const RunHistory* history_;
  bool has_second_;
  SceneStyle style_;
  std::optional<double> time_s_;
  bool plays_ = false, shows_panels_ = true, shows_help_ = false, wants_to_close_ = false, show_all_ = false,
       screenshot_ = false;
};

}  // namespace gelslam::viewer::detail
