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

/// Half of the cells differ by more (norm over the channels, gray levels): a touch changes fewer of them,
/// another light all of them, also one that brightens one side and darkens the other.
double common_difference(const cv::Mat3f& cells, const cv::Mat3f& reference);
/// More is another light, gel or sensor: 224 presses of three sensors differ from their background by at most
/// 1.9, from those of other sensors by 8 or more.
inline constexpr double kMaxLightLevels = 6.0;

/// Returns false where the untouched part of a picture has another color than the background of its size, as
/// in another light, gel or sensor. Exposure counts; touches on less than half of the picture do not.
bool has_same_light(const cv::Mat3b& picture, const cv::Mat3b& background);

}  // namespace gelslam
