#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gelslam {

/// The middle value, of an even number the upper one of two; 0 when there is none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value below which this share of them lies, 0..1, by nearest rank: always one that occurs; 0 when there
/// is none. Reorders `values`.
template <typename Value>
Value quantile_in_place(std::vector<Value>& values, double share) {
  if (values.empty()) return Value{};
  const auto rank = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), rank, values.end());
  return *rank;
}

/// The same of a copy.
template <typename Value>
Value quantile(std::vector<Value> values, double share) {
  return quantile_in_place(values, share);
}

}  // namespace gelslam
