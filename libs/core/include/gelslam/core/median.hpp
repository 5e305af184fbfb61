#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gelslam {

/// Returns the median; for an even number of values, the upper one of the two in the middle. 0 if there are
/// none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the quantile at `share` (0..1) by nearest rank, so that it is always one of the values; 0 if there
/// are none. Reorders `values`.
template <typename Value>
Value quantile_in_place(std::vector<Value>& values, double share) {
  if (values.empty()) return Value{};
  const auto rank = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), rank, values.end());
  return *rank;
}

/// As quantile_in_place(), for a copy of the values.
template <typename Value>
Value quantile(std::vector<Value> values, double share) {
  return quantile_in_place(values, share);
}

}  // namespace gelslam
