#pragma once

#include "gelslam/viewer/collect_window.hpp"
#include "ui/window_canvas.hpp"
#include "ui/window_texture.hpp"

namespace gelslam::viewer::detail {

/// The picture three times as large, with the circle and the lines between the ninths; empty without a
/// picture.
cv::Mat3b collect_picture(const CollectView& view);

/// All of the window's flat parts: the picture with the counts of its ninths, and the side that says what to
/// do.
void draw_collect_panels(Canvas& canvas, const Box& window, const WindowTexture& picture,
                         const CollectView& view);

}  // namespace gelslam::viewer::detail
