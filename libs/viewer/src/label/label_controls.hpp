#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/calibration/label_session.hpp"
#include "ui/key_binding.hpp"

namespace gelslam::viewer::detail {

/// Everything a person can ask of the window of `gelslam calibrate label`.
enum class LabelAction {
  accept,
  back,
  next,
  leave_out,
  accept_rest,
  left,
  right,
  up,
  down,
  wider,
  narrower,
  use_found,
  difference,
  undo,
  save,
  screenshot,
  help,
  quit,
};

/// In the order of the help; some actions have two lines of keys.
const std::vector<KeyBinding<LabelAction>>& label_keys();

/// What keys, buttons and the mouse do to a session, without a pixel of how it looks. Places are pixels of
/// the press's picture, times the window's clock.
class LabelControls {
 public:
  explicit LabelControls(LabelSession& session) : session_(session) {}

  void press_key(int key, double now_s);
  /// quit saves first; where that fails, the first one stays, and the next one leaves.
  void perform(LabelAction action, double now_s);

  /// A drag takes the rim where it begins within `reach_px` of it, else the center.
  void begin_drag(double u_px, double v_px, double reach_px);
  void drag_to(double u_px, double v_px);
  void end_drag() { drag_.reset(); }
  void change_radius(double by_px);  ///< one step of undo for steps that follow each other
  void show(std::size_t label);

  bool drags_rim() const { return drag_ && drag_->rim; }
  bool shows_difference() const { return shows_difference_; }
  bool shows_help() const { return shows_help_; }
  bool wants_to_close() const { return wants_to_close_; }
  std::size_t written() const { return written_; }
  const std::string& message() const { return message_; }
  void say(std::string message, double now_s);
  void forget_old_message(double now_s);
  bool take_screenshot() { return std::exchange(screenshot_, false); }

 private:
  struct Drag {
    bool rim = false, moved = false;
    double u_px = 0.0, v_px = 0.0;  ///< where it began
    ContactCircle circle;           ///< as it was then
  };

  void move(double du_px, double dv_px);
  void accept_rest_of_them(double now_s);
  bool save_now(double now_s);  ///< false when something could not be saved
  void end(double now_s);

  LabelSession& session_;
  std::optional<Drag> drag_;
  bool turns_wheel_ = false;  ///< the last change was one of the radius
  bool shows_difference_ = false, shows_help_ = false, wants_to_close_ = false, screenshot_ = false;
  bool leaves_unsaved_ = false;  ///< the last thing done was a quit that could not save
  std::size_t written_ = 0;
  std::string message_;
  double message_until_s_ = 0.0;
};

}  // namespace gelslam::viewer::detail
