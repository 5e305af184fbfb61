#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/calibration/label_session.hpp"
#include "gelslam/viewer/controls.hpp"

namespace gelslam::calibration::detail {

/// What keys, buttons and the mouse do to a session of labels. Positions are pixels of the press's picture.
/// With a camera its picture comes behind the last press. Closing saves first; where that fails the window
/// stays, and closing once more leaves.
class PressControls : public viewer::Controls {
 public:
  PressControls(LabelSession& session, bool has_camera);

  /// A drag takes the rim where it begins within `reach_px` of it, else the center.
  void begin_drag(double u_px, double v_px, double reach_px);
  void drag_to(double u_px, double v_px);
  void end_drag() { drag_.reset(); }
  void nudge(double du_px, double dv_px, double dradius_px);
  void show(std::size_t label);  ///< behind the last one: the camera, if there is one

  bool shows_camera() const { return shows_camera_; }
  bool drags_rim() const { return drag_ && drag_->rim; }
  viewer::ButtonLook button(const viewer::ActionRow& row) const override;
  std::vector<std::pair<std::string, std::string>> mouse_help() const override;

 protected:
  void act(viewer::Action action, double now_s) override;

 private:
  struct Drag {
    bool rim = false;
    double u_px = 0.0, v_px = 0.0;  ///< where it began
    ContactCircle circle;           ///< as it was then
  };

  void act_on_press(viewer::Action action);
  void accept_rest_of_them(double now_s);
  void save_and_close(double now_s);

  LabelSession& session_;
  const bool has_camera_;
  bool shows_camera_;
  std::optional<Drag> drag_;
  bool leaves_unsaved_ = false;  ///< the last thing done was a close that could not save
};

}  // namespace gelslam::calibration::detail
