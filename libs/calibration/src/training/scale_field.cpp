#include "training/scale_field.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam::calibration::detail {

void ScaleField::Regression::note(double read, double truth) {
  read_true += read * truth;
  true_true += truth * truth;
}

void ScaleField::Regression::update() {
  constexpr double keep = 0.98, follow = 0.02, bound = 1.25, enough = 1e-3;
  if (true_true > enough)
    stretch = std::clamp(stretch * (1.0 + follow * (1.0 - read_true / true_true)), 1.0 / bound, bound);
  read_true *= keep;
  true_true *= keep;
}

void ScaleField::note(const Pair& place, const Pair& read, const Pair& truth) {
  const auto third = [](float along) {
    return std::min<std::size_t>(2, static_cast<std::size_t>(3.0F * along));
  };
  const std::size_t ninth = 3 * third(place[1]) + third(place[0]);
  const auto steepness = std::hypot(static_cast<double>(truth[0]), static_cast<double>(truth[1]));
  const auto step = std::min(kSteps - 1, static_cast<std::size_t>(steepness / kStepRad));
  for (std::size_t axis = 0; axis < 2; ++axis) {
    by_place_[axis][ninth].note(static_cast<double>(read[axis]), static_cast<double>(truth[axis]));
    by_steepness_[step].note(static_cast<double>(read[axis]), static_cast<double>(truth[axis]));
  }
}

void ScaleField::update() {
  for (auto& axis : by_place_)
    for (Regression& ninth : axis) ninth.update();
  for (Regression& step : by_steepness_) step.update();
}

ScaleField::Pair ScaleField::stretched(const Pair& place, const Pair& truth) const {
  const double x = std::clamp(3.0 * static_cast<double>(place[0]) - 0.5, 0.0, 2.0),
               y = std::clamp(3.0 * static_cast<double>(place[1]) - 0.5, 0.0, 2.0);
  const auto column = std::min<std::size_t>(1, static_cast<std::size_t>(x)),
             row = std::min<std::size_t>(1, static_cast<std::size_t>(y));
  const double right = x - static_cast<double>(column), down = y - static_cast<double>(row);
  const double along =
      std::clamp(std::hypot(static_cast<double>(truth[0]), static_cast<double>(truth[1])) / kStepRad - 0.5,
                 0.0, kSteps - 1.0);
  const auto step = std::min(kSteps - 2, static_cast<std::size_t>(along));
  const double up = along - static_cast<double>(step);
  const double steep = (1.0 - up) * by_steepness_[step].stretch + up * by_steepness_[step + 1].stretch;
  Pair result{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto at = [&](std::size_t r, std::size_t c) { return by_place_[axis][3 * r + c].stretch; };
    const double placed = (1.0 - down) * ((1.0 - right) * at(row, column) + right * at(row, column + 1)) +
                          down * ((1.0 - right) * at(row + 1, column) + right * at(row + 1, column + 1));
    result[axis] = static_cast<float>(placed * steep) * truth[axis];
  }
  return result;
}

}  // namespace gelslam::calibration::detail
