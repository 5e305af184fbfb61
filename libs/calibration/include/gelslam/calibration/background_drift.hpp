#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>

namespace gelslam {

/// How the bare gel differs from when a model was made.
struct BackgroundDrift {
  std::array<double, 3> light_gain{1.0, 1.0, 1.0};  ///< B, G, R: brightness now over then
  double light_change_levels = 0.0;  ///< by how much the mean color differs, root mean square over channels
  double gel_change_levels = 0.0;  ///< what a change of light does not explain, root mean square over the gel
  double worst_cell_levels = 0.0;  ///< the same at the worst place
  bool light_changed = false, gel_changed = false;
  /// the pictures agree far better when red and blue are exchanged
  bool red_blue_swapped = false;
  std::string words;  ///< one sentence for people
};

/// Compares cells as background_cells() (gelslam/surface/model_file.hpp) makes them, 20x15 mean colors. What
/// follow_light() does not explain is a change of the gel (another one, dirt, wear).
BackgroundDrift measure_drift(const cv::Mat3f& then, const cv::Mat3f& now);

/// False where the untouched part of a picture has another color than the background of its size, as in
/// another light, gel or sensor. Exposure counts; touches on less than half of the picture do not.
bool has_same_light(const cv::Mat3b& picture, const cv::Mat3b& background);

}  // namespace gelslam
