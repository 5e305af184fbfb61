#include "gelslam/core/median.hpp"

namespace gelslam {

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double quantile(std::vector<double> values, double share) { return quantile_in_place(values, share); }

}  // namespace gelslam
