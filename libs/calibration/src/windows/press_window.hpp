#pragma once

#include <optional>

#include "gelslam/calibration/press_window.hpp"
#include "gelslam/viewer/window_loop.hpp"
#include "windows/press_controls.hpp"

namespace gelslam::calibration::detail {

/// Positions of the window's parts. Parts for which there is no room are empty.
struct PressLayout {
  viewer::Box head, view, side, strip, bar;
  viewer::Box picture;    ///< Area of the image of the press or camera, within `view`.
  float enlargement = 1;  ///< Window pixels per image pixel.

  float x_of(double u_px) const { return picture.x + static_cast<float>(u_px + 0.5) * enlargement; }
  float y_of(double v_px) const { return picture.y + static_cast<float>(v_px + 0.5) * enlargement; }
  double u_of(float x) const { return static_cast<double>((x - picture.x) / enlargement) - 0.5; }
  double v_of(float y) const { return static_cast<double>((y - picture.y) / enlargement) - 0.5; }
};

/// The window of `gelslam calibrate collect`.
class PressWindow : public viewer::WindowLoop {
 public:
  PressWindow(LabelSession& session, CollectWatch* camera, const PressWindowOptions& options);
  ~PressWindow() override { host().make_current(); }

  /// Runs the window until it is closed, and then saves. Throws Error when something remains unsaved.
  void run_and_save();
  PressControls& controls() override { return controls_; }
  const PressLayout& layout() const { return layout_; }

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(viewer::Ui& ui, double now_s) override;
  bool closes_by_itself() override { return live_.closes; }
  void pressed(int button, const Eigen::Vector2f& at_px, double now_s) override;
  void moved(const Eigen::Vector2f& to_px) override;
  void released(int button) override;
  void scrolled(double steps, const Eigen::Vector2f& at_px) override;

  void follow_camera();
  void show_picture();
  bool is_on_press(const Eigen::Vector2f& at_px) const;

  LabelSession& session_;
  CollectWatch* camera_;
  PressWindowOptions options_;
  PressControls controls_;
  CollectView live_;
  viewer::Texture texture_;
  std::optional<std::size_t> shown_;  ///< Index of the press whose image is in the texture.
  bool end_asked_ = false;
  PressLayout layout_;
};

// The window's panels.
PressLayout lay_out_presses(const viewer::Ui& ui, const cv::Size& picture);
void draw_press(viewer::Ui& ui, const PressLayout& layout, const LabelSession& session,
                const viewer::Texture& picture, bool rim_is_held);
void draw_press_side(viewer::Ui& ui, const viewer::Box& side, const LabelSession& session,
                     double pixel_pitch_mm);
/// Draws the camera's image, and in each ninth of it how many presses are missing or were taken.
void draw_camera(viewer::Ui& ui, const PressLayout& layout, const CollectView& view,
                 const viewer::Texture& picture);
void draw_camera_side(viewer::Ui& ui, const viewer::Box& side, const CollectView& view);
/// Draws a mark for each press and one for the camera. Returns the one that was clicked.
std::optional<std::size_t> draw_strip(viewer::Ui& ui, const PressLayout& layout, const LabelSession& session,
                                      bool has_camera, bool shows_camera);

}  // namespace gelslam::calibration::detail
