#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"

namespace gelslam::calibration::detail {

/// One pixel whose slope is known.
struct SlopeSample {
  std::array<float, 3> color{}, flat_color{};  ///< BGR/255 of the press and of the background there
  std::array<float, 2> place{};                ///< u/W, v/H
  std::array<float, 2> angle_rad{};            ///< of dh/dx, dh/dy
  int u_px = 0, v_px = 0, zone = 0;
};

/// Pixels inside the zones, on a grid just fine enough for about `wanted` in all, zones in turn.
std::vector<SlopeSample> zone_samples(const PressSet& set, const std::vector<BallZone>& zones,
                                      double pixel_pitch_mm, int wanted);

/// How color follows slope and place on the whole gel, smoothly: for each channel, the change against the
/// background is a polynomial in the slope angles (degree 4) whose coefficients are polynomials in the place
/// (degree 4). Its constant is not 0: gel that is pressed in flat does not look like bare gel. Least squares
/// with a ridge that grows with the degree. The change is counted in gray levels, or as a share of the
/// background's light, which a lamp that is weaker in a corner takes from the bare and from the tilted gel
/// alike: whichever tells more of presses that are left out of the fit.
class ColorField {
 public:
  static constexpr int kSlopeTerms = 15, kPlaceTerms = 15;  ///< of the two polynomials

  explicit ColorField(const std::vector<SlopeSample>& samples);

  /// Color change (BGR) that a slope makes at a place (u/W, v/H), in units of unit().
  std::array<float, 3> change(const std::array<float, 2>& place, const std::array<float, 2>& angle_rad) const;

  /// What one of the change is where the background's channel (0..1) is `flat`.
  float unit(float flat) const;

 private:
  bool relative_ = false;
  std::array<std::array<float, kSlopeTerms * kPlaceTerms>, 3> coefficients_{};
};

/// Undoes regression to the mean (own). A network trained on noisy colors reads slopes too flat, by a factor
/// that differs from place to place, and most at the steep end of what it has seen. While training, the
/// regression of read on true angles is followed for each ninth of the gel and axis, and for steps of
/// steepness; the angles asked for are stretched until all are 1. Between ninths and steps the stretch is
/// interpolated.
class ScaleField {
 public:
  using Pair = std::array<float, 2>;

  /// A reading at `place` (u/W, v/H) whose true angles (rad) are known.
  void note(const Pair& place, const Pair& read, const Pair& truth);

  /// After each step: forgets slowly, and stretches a little more where read slopes are still too flat.
  void update();

  /// What to ask the network for, so that it reads `truth`.
  Pair stretched(const Pair& place, const Pair& truth) const;

 private:
  static constexpr std::size_t kNinths = 9, kSteps = 8;
  static constexpr double kStepRad = 0.08;

  struct Regression {
    double read_true = 0.0, true_true = 0.0, stretch = 1.0;
    void note(double read, double truth);
    void update();
  };

  std::array<std::array<Regression, kNinths>, 2> by_place_;  ///< per axis
  std::array<Regression, kSteps> by_steepness_;
};

}  // namespace gelslam::calibration::detail
