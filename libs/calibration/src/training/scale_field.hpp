#pragma once

#include <array>
#include <cstddef>

namespace gelslam::calibration::detail {

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
