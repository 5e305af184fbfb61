#pragma once

#include <optional>
#include <vector>

#include "gelslam/backend/rig.hpp"
#include "gelslam/localization/localizer.hpp"

namespace gelslam {

/// Where a sensor was at this time, not before `before` and not after `after`, two frames that follow each
/// other. Nothing unless it was localized around it, in one trial without a gap.
std::optional<PlaceHypothesis> place_between(const LocalizedFrame& before, const LocalizedFrame& after,
                                             double time_s);

/// Adds to `first`, a frame of the first of two sensors that are fixed to each other, what the second one
/// knows of its own place at the same time: it is localized if either is. Where both are, the place is their
/// mean by covariances; where they contradict each other (kMaxMismatch, with what maps err by), the one of
/// the smaller covariance, and `reason` says so. Returns the sensors, 0 and 1, that the place is of.
std::vector<int> share_place(LocalizedFrame& first, const std::optional<PlaceHypothesis>& second,
                             const RigPose& rig);

}  // namespace gelslam
