#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/viewer/scene_style.hpp"

namespace gelslam::viewer::detail {

/// Words over a picture (8-bit BGR), sizes by the picture's height. `area` is the part of the picture they
/// belong to.
void draw_title(cv::Mat3b& picture, const cv::Rect& area, const std::string& title, bool light_theme);
/// A bar at the lower right with numbers at its ends and middle.
void draw_legend(cv::Mat3b& picture, const cv::Rect& area, const ColorLegend& legend, bool light_theme);
/// A bar of 1, 2 or 5 times a power of ten millimetres at the lower left.
void draw_scale_bar(cv::Mat3b& picture, const cv::Rect& area, double mm_per_px, bool light_theme);

}  // namespace gelslam::viewer::detail
