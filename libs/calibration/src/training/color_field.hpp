#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"

namespace gelslam::calibration::detail {

/// A pixel of a press with its known slope.
struct SlopeSample {
  std::array<float, 3> color{}, flat_color{};  ///< BGR/255 of the press and of the background at the pixel.
  std::array<float, 2> place{};                ///< u/W, v/H
  std::array<float, 2> angle_rad{};            ///< Slope angles of dh/dx and dh/dy.
  int u_px = 0, v_px = 0, zone = 0;
};

/// Returns about `wanted` pixels from the zones, distributed evenly.
std::vector<SlopeSample> zone_samples(const PressSet& set, const std::vector<BallZone>& zones,
                                      double pixel_pitch_mm, int wanted);

/// A smooth model of how the color depends on slope and place over the whole gel. For each channel, the
/// change against the background is a polynomial of degree 4 in the slope angles, whose coefficients are
/// polynomials of degree 4 in the place. Its constant term is not 0, because gel that is pressed in flat does
/// not look like bare gel. It is fitted by least squares with a ridge penalty that grows with the degree. The
/// change is either absolute (gray levels) or relative to the background's brightness, which models a lamp
/// that is weaker in a corner for bare and tilted gel alike. Cross-validation over presses decides between
/// the two.
class ColorField {
 public:
  static constexpr int kSlopeTerms = 15, kPlaceTerms = 15;  ///< of the two polynomials

  explicit ColorField(const std::vector<SlopeSample>& samples);

  /// Returns the color change (BGR) that a slope causes at a place (u/W, v/H), in units of unit().
  std::array<float, 3> change(const std::array<float, 2>& place, const std::array<float, 2>& angle_rad) const;

  /// Returns the unit of the change, in 0..1, where the background's channel has the value `flat` (0..1).
  float unit(float flat) const;

 private:
  bool relative_ = false;
  std::array<std::array<float, kSlopeTerms * kPlaceTerms>, 3> coefficients_{};
};

/// Compensates regression to the mean (not in the paper). A network that is trained on noisy colors reads
/// slopes too flat, by a factor that depends on the place and is largest for the steepest slopes in the
/// training data. During training, the regression of read on true angles is tracked for each ninth of the gel
/// and axis, and for intervals of steepness. The training targets are stretched until all regressions are 1.
/// Between ninths and intervals the factor is interpolated.
class ScaleField {
 public:
  using Pair = std::array<float, 2>;

  /// Records a reading at `place` (u/W, v/H) with known true angles (rad).
  void note(const Pair& place, const Pair& read, const Pair& truth);

  /// To be called after each training step: lets old readings fade, and adjusts each stretch factor by a
  /// small step.
  void update();

  /// Returns the training target for which the network will read `truth`.
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
