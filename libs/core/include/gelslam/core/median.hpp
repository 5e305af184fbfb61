#pragma once

#include <vector>

namespace gelslam {

/// The middle value, of an even number the upper one of two; 0 when there is none.
double median(std::vector<double> values);

}  // namespace gelslam
