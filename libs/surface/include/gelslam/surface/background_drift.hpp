#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>

namespace gelslam {

/// How the bare gel looks now, compared with how it looked when a model was calibrated. Levels are gray
/// levels (0 to 255), root mean squares over the three channels.
struct BackgroundDrift {
  std::array<double, 3> light_gain{1.0, 1.0, 1.0};  ///< brightness now divided by then, of B, G, R
  double light_change_levels = 0.0;  ///< the change of the mean color that the change of light causes
  double gel_change_levels = 0.0;    ///< the change that no light explains, root mean square over the gel
  double worst_cell_levels = 0.0;    ///< the largest change of a cell that no light explains
  bool light_changed = false, gel_changed = false;  ///< the changes exceed their limits
  /// Names what seems to be exchanged ("red and blue", "left and right"), because the pictures agree far
  /// better when it is exchanged back; else "".
  std::string exchanged;
  std::string difference;  ///< says to the user what has changed
  std::string words;       ///< `difference` and what to do about it, in one sentence
};

/// Compares the bare gel at the time of calibration and now. Both are given as the mean colors of 20x15 cells
/// (B, G, R in gray levels) from background_cells() in gelslam/surface/model_file.hpp. A difference that
/// follow_light() does not explain is a change of the gel: another gel, dirt or wear.
BackgroundDrift measure_drift(const cv::Mat3f& then, const cv::Mat3f& now);

/// Returns a picture as it would look in the light of a background of the same size. The light is estimated
/// as SurfaceEstimator does. If the light is the same, the result equals the picture.
cv::Mat3b in_light_of(const cv::Mat3b& background, const cv::Mat3b& picture);

/// Returns whether the untouched part of a picture shows the gel of a background. `followed` is the picture
/// after in_light_of(). The result is false for another gel or sensor, and after a change of light that
/// in_light_of() cannot compensate. A contact on less than half of the picture has no influence, because the
/// median over the cells is judged.
bool shows_same_gel(const cv::Mat3b& followed, const cv::Mat3b& background);

}  // namespace gelslam
