#pragma once

#include <string>
#include <vector>

namespace gelslam {

/// Slope of a ball of `ball_px` pixels radius at `radius_px` from its middle: the steepest that a zone shows.
double rim_slope(double radius_px, double ball_px);

/// For people: what touches the presses say nothing of, by their rim slopes; "" when they are mixed. A model
/// of shallow presses guesses steeper slopes (20 % too flat on a simulated sensor), and one of deep presses
/// reads lighter touches wrong where lamps are near (7 % too flat on one): their gel lies at another height.
std::string missing_depths(const std::vector<double>& rim_slopes);

}  // namespace gelslam
