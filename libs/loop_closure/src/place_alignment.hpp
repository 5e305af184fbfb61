#pragma once

#include <optional>
#include <vector>

#include "descriptor_matching.hpp"
#include "gelslam/core/se3.hpp"

namespace gelslam::loop_closure::detail {

/// Matches (a = older, b = newer) that one rotation and shift in the image explains. Rigid, not similar: the
/// projection is orthographic, so a place has one scale. Same input, same answer (explicit seed).
std::vector<Match> rigid_inliers(const PlaceFeatures& older, const PlaceFeatures& newer,
                                 const std::vector<Match>& matches, double threshold_px, int iterations);

/// older_T_newer from matched points and the normals there: the points give twist and shift, the normals
/// tilt. Nothing with fewer than 3 matches.
std::optional<Pose> lift(const Surface& older, const Surface& newer, const PlaceFeatures& older_features,
                         const PlaceFeatures& newer_features, const std::vector<Match>& matches);

}  // namespace gelslam::loop_closure::detail
