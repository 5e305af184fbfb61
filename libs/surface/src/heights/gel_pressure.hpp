#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Where something presses on the gel, told apart from the membrane rim, where the gel only hangs between
/// what presses and the rest (own). The gel is taken as a stretched membrane on an elastic foundation:
/// pressure is proportional to d - λ² Δd for a depth d, so that it vanishes on a membrane rim (which decays
/// with the length λ), equals d under a flat face, and exceeds d under a convex one. A place is pressed where
/// the pressure is more than half of d, on a scale of about half a millimetre: finer texture belongs to the
/// object and must not tear holes into its mask.
class PressureMap {
 public:
  /// `rim_length_mm`: λ, a property of the gel.
  explicit PressureMap(double rim_length_mm) : rim_length_mm_(rim_length_mm) {}

  /// Fills `pressed` (HxW, 0 or 255) from heights (0 on the untouched gel, negative in contact).
  void find(const cv::Mat1f& height_mm, double pixel_pitch_mm, cv::Mat1b& pressed);

 private:
  double rim_length_mm_;
  cv::Mat1f depth_, laplacian_, excess_, excess_px_;
};

}  // namespace gelslam::surface::detail
