#pragma once

#include <vector>

#include "place_features.hpp"

namespace gelslam::loop_closure::detail {

struct Match {
  int a = 0, b = 0;  ///< feature indices
};

/// Matches that are each other's nearest (L2) and clearly nearer than the second nearest in both directions
/// (Lowe 2004, `max_ratio` on distances): what looks like several places is no evidence for one.
std::vector<Match> match_features(const PlaceFeatures& a, const PlaceFeatures& b, double max_ratio);

}  // namespace gelslam::loop_closure::detail
