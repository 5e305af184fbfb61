#pragma once

#include "gelslam/registration/normal_flow.hpp"
#include "texture_agreement.hpp"

namespace gelslam::registration::detail {

/// How far the sensor may have moved along a direction in which a pattern of the gel pulls the pose back, as
/// a share of the prior's sigma: from one frame to the next, and at worst.
inline constexpr double kUsualPull = 0.1, kWorstPull = 1.0;

/// Information of a registered pose, in the order and axes of RegistrationResult::information. The normals
/// tell the shown directions, the heights z at the shared center, and both err with the motion between the
/// two frames: a slope that is read too steep turns every roll by its share, and what belongs to the gel
/// pulls towards no motion. Sizes measured by apps/bench/information_study. (Own.)
Matrix6d pose_information(const ShownDirections& shown, bool heights_known, double pull,
                          const RegistrationResult& result, const NormalFlowOptions& options);

}  // namespace gelslam::registration::detail
