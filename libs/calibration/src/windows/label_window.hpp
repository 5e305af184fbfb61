#pragma once

#include <exception>
#include <optional>
#include <utility>

#include "gelslam/calibration/label_window.hpp"
#include "gelslam/viewer/window_loop.hpp"
#include "windows/label_controls.hpp"

namespace gelslam::calibration::detail {

/// Where the parts of the window lie; parts for which there is no room are empty.
struct LabelLayout {
  viewer::Box head, view, side, strip, bar;
  viewer::Box picture;    ///< of the press, in the view
  float enlargement = 1;  ///< window pixels per pixel of the press

  float x_of(double u_px) const { return picture.x + static_cast<float>(u_px + 0.5) * enlargement; }
  float y_of(double v_px) const { return picture.y + static_cast<float>(v_px + 0.5) * enlargement; }
  double u_of(float x) const { return static_cast<double>((x - picture.x) / enlargement) - 0.5; }
  double v_of(float y) const { return static_cast<double>((y - picture.y) / enlargement) - 0.5; }
  viewer::Box mark(std::size_t label, std::size_t labels) const;  ///< of a press in the strip
};

/// The window of `gelslam calibrate label`, frame by frame.
class LabelWindow : public viewer::WindowLoop {
 public:
  LabelWindow(LabelSession& session, const LabelWindowOptions& options);
  ~LabelWindow() override { host().make_current(); }

  /// Until it is closed; saves at the end. Throws Error when something stays unsaved.
  void run_and_save();
  std::size_t written() const { return controls_.written() + written_at_end_; }
  LabelControls& controls() override { return controls_; }
  const LabelLayout& layout() const { return layout_; }

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(viewer::Ui& ui, double now_s) override;
  void pressed(int button, const Eigen::Vector2f& at_px, double now_s) override;
  void moved(const Eigen::Vector2f& to_px) override;
  void released(int button) override;
  void scrolled(double steps, const Eigen::Vector2f& at_px) override;

  void save_after(const std::exception& failure);
  void show_press();

  LabelSession& session_;
  LabelWindowOptions options_;
  LabelControls controls_;
  viewer::Texture texture_;
  std::optional<std::pair<std::size_t, bool>> shown_;  ///< press and whether its difference, of the texture
  bool end_asked_ = false;
  std::size_t written_at_end_ = 0;
  LabelLayout layout_;
};

/// What the press changed: the difference to the bare gel around mid-gray, stretched so that nearly all of it
/// (99 %) fits. What the whole picture has in common (another exposure) is taken off. Both of one size.
cv::Mat3b difference_picture(const cv::Mat3b& bgr, const cv::Mat3b& background);

// Its panels.
LabelLayout lay_out_labels(const viewer::Ui& ui, const cv::Size& press);
void draw_press(viewer::Ui& ui, const LabelLayout& layout, const LabelSession& session,
                const viewer::Texture& picture, bool rim_is_held);
void draw_label_side(viewer::Ui& ui, const viewer::Box& side, const LabelSession& session,
                     double pixel_pitch_mm);
/// One mark per press; the one that was clicked.
std::optional<std::size_t> draw_strip(viewer::Ui& ui, const LabelLayout& layout, const LabelSession& session);

}  // namespace gelslam::calibration::detail
