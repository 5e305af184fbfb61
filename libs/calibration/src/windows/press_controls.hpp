#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/calibration/label_session.hpp"
#include "gelslam/viewer/controls.hpp"

namespace gelslam::calibration::detail {

/// Handles keys, buttons and the mouse in a session of labels. Positions are pixels of the press's image. If
/// there is a camera, its image comes after the last press. Closing saves first. If saving fails, the window
/// stays open; closing a second time leaves without saving.
class PressControls : public viewer::Controls {
 public:
  PressControls(LabelSession& session, bool has_camera);

  /// A drag changes the radius if it begins within `reach_px` of the rim, else it moves the center.
  void begin_drag(double u_px, double v_px, double reach_px);
  void drag_to(double u_px, double v_px);
  void end_drag() { drag_.reset(); }
  void nudge(double du_px, double dv_px, double dradius_px);
  void show(std::size_t label);  ///< An index after the last press shows the camera, if there is one.

  bool shows_camera() const { return shows_camera_; }
  bool drags_rim() const { return drag_ && drag_->rim; }
  viewer::ButtonLook button(const viewer::ActionRow& row) const override;
  std::vector<std::pair<std::string, std::string>> mouse_help() const override;

 protected:
  void act(viewer::Action action, double now_s) override;

 private:
  struct Drag {
    bool rim = false;
    double u_px = 0.0, v_px = 0.0;  ///< Where the drag began.
    ContactCircle circle;           ///< Circle at the beginning of the drag.
  };

  void act_on_press(viewer::Action action);
  void accept_rest_of_them(double now_s);
  void save_and_close(double now_s);

  LabelSession& session_;
  const bool has_camera_;
  bool shows_camera_;
  std::optional<Drag> drag_;
  bool leaves_unsaved_ = false;  ///< True after an attempt to close that could not save.
};

}  // namespace gelslam::calibration::detail
