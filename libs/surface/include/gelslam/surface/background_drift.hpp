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
  /// the pictures agree far better when these are exchanged ("red and blue", "left and right"); or ""
  std::string exchanged;
  std::string difference;  ///< for people
  std::string words;       ///< the same, and what to do: one sentence
};

/// Compares cells as background_cells() (gelslam/surface/model_file.hpp) makes them, 20x15 mean colors. What
/// follow_light() does not explain is a change of the gel (another one, dirt, wear).
BackgroundDrift measure_drift(const cv::Mat3f& then, const cv::Mat3f& now);

/// Returns a picture as it would have been in the light of a background of its size, followed as surfaces
/// follow it from frame to frame. The picture itself where the light is the same.
cv::Mat3b in_light_of(const cv::Mat3b& background, const cv::Mat3b& picture);

/// Says whether the untouched part of a picture that in_light_of() has turned into a background's light shows
/// the gel of that background. False: another gel or sensor, or a light that cannot be taken off. Touches on
/// less than half of the picture do not count.
bool shows_same_gel(const cv::Mat3b& followed, const cv::Mat3b& background);

}  // namespace gelslam
