#pragma once

#include <vector>

namespace gelslam {

/// The middle value, of an even number the upper one of two; 0 when there is none.
double median(std::vector<double> values);

/// The value below which this share of them lies, 0..1, by nearest rank: always one that occurs; 0 when there
/// is none.
double quantile(std::vector<double> values, double share);

}  // namespace gelslam
