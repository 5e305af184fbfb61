#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

/// How a pattern that repeats itself (a ruler's marks, the thread of a bolt) looks in a picture.
struct PatternWave {
  double fx = 0.0, fy = 0.0;  ///< periods per pixel; fx >= 0
  /// Relative standard deviation of the length of (fx, fy): by how much halves of the picture differ, at
  /// least as much as uneven light causes.
  double uncertainty = 0.0;
  double period_px() const;
};

/// Finds the wave with `period_px` pixels per period, within a quarter (own: peak of the windowed spectrum of
/// all three channels, refined between its bins). Nothing when no wave stands out there, or when the picture
/// holds fewer than four periods. Both images of one size.
std::optional<PatternWave> find_pattern(const cv::Mat3b& bgr, const cv::Mat3b& background, double period_px);

/// A configured pitch that is further off is worth changing: slopes and sizes are wrong by as much.
inline constexpr double kMaxPitchError = 0.01;
/// Pictures whose pixels are further from square must be stretched; below, x and y are each within
/// kMaxPitchError of the pitch between them.
inline constexpr double kMaxUnsquare = 2.0 * kMaxPitchError;

/// Pitch of y over pitch of x: how much higher than wide pixels are.
struct PixelAspect {
  double y_over_x = 1.0;
  double uncertainty = 0.0;  ///< one standard deviation
  /// How far from square they may be without being called not square: two standard deviations, at least
  /// kMaxUnsquare.
  double tolerance() const;
};

struct PixelPitch {
  double x_mm = 0.0, y_mm = 0.0;
  double x_uncertainty_mm = 0.0, y_uncertainty_mm = 0.0;
  bool both_axes = false;  ///< false: all waves run alike, and x_mm is y_mm by assumption
  PixelAspect aspect() const;
};

/// Pitch from pictures of a pattern of known period: a wave of period P along a direction of the gel obeys
/// (fx / pitch_x)^2 + (fy / pitch_y)^2 = 1 / P^2. Two waves more than 30 degrees apart tell both axes. Throws
/// std::invalid_argument without waves or for a period that is not positive.
PixelPitch pitch_from_pattern(const std::vector<PatternWave>& waves, double period_mm);

/// From balls, whose contacts and slopes are round in millimeters: the aspect with which a ball explains its
/// picture best, the median over presses (own). A pitch that is wrong on both axes stays hidden. Nothing with
/// fewer than five presses whose contact lies whole in the picture.
std::optional<PixelAspect> aspect_from_balls(const PressSet& set, const std::vector<BallZone>& zones,
                                             double pixel_pitch_mm);

}  // namespace gelslam
