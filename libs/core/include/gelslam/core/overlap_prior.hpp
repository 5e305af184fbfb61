#pragma once

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// Where turns and slides are compared, a radian counts as the motion that it causes this far from the axis:
/// half a contact.
inline constexpr double kMmPerRad = 5.0;

/// Information of the motion between two frames that overlap, whatever they show: one radian, and the motion
/// that it causes (kMmPerRad). It decides only along directions that are not observable.
inline Vector6d overlap_prior() {
  constexpr double kPerMm2 = 1.0 / (kMmPerRad * kMmPerRad);
  return (Vector6d() << 1, 1, 1, kPerMm2, kPerMm2, kPerMm2).finished();
}

}  // namespace gelslam
