#pragma once

#include <optional>

#include "label/label_controls.hpp"
#include "ui/window_canvas.hpp"
#include "ui/window_texture.hpp"

namespace gelslam::viewer::detail {

/// Where the parts of the window of `gelslam calibrate label` lie; parts for which there is no room are
/// empty.
struct LabelLayout {
  Box view, side, strip, bar;
  Box picture;            ///< of the press, in the view
  float enlargement = 1;  ///< window pixels per pixel of the press

  float x_of(double u_px) const { return picture.x + static_cast<float>(u_px + 0.5) * enlargement; }
  float y_of(double v_px) const { return picture.y + static_cast<float>(v_px + 0.5) * enlargement; }
  double u_of(double x) const {
    return (x - static_cast<double>(picture.x)) / static_cast<double>(enlargement) - 0.5;
  }
  double v_of(double y) const {
    return (y - static_cast<double>(picture.y)) / static_cast<double>(enlargement) - 0.5;
  }
  /// The label whose mark in the strip is there.
  std::optional<std::size_t> label_at(double x, double y, std::size_t labels) const;
  Box mark(std::size_t label, std::size_t labels) const;
};
LabelLayout lay_out_labels(const Canvas& canvas, float width_px, float height_px, const cv::Size& press);

/// All of it. Buttons go to `controls`.
void draw_label_panels(Canvas& canvas, const LabelLayout& layout, const LabelSession& session,
                       const WindowTexture& picture, double pixel_pitch_mm, double now_s,
                       LabelControls& controls);

// The part at the right, in its own file.
void draw_label_side(Canvas& canvas, const Box& side, const LabelSession& session, double pixel_pitch_mm);
ImU32 color_of(const PressLabel& label);

}  // namespace gelslam::viewer::detail
