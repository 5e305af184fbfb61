#include "gelslam/localization/rig_place.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

// By how much two places of a map may lie wrong to each other (docs/localization.md), which covariances of
// poses at them do not contain.
constexpr double kMapSigmaMm = 0.1, kMapSigmaRad = 0.014;

/// Of the first sensor, from that of the second one.
PlaceHypothesis through(const RigPose& rig, const PlaceHypothesis& second) {
  const Matrix6d turn = adjoint(rig.first_T_second);
  return {normalized(second.map_T_sensor * rig.first_T_second.inverse()),
          turn * (second.covariance + rig.covariance) * turn.transpose(), second.probability};
}

}  // namespace

std::optional<PlaceHypothesis> place_between(const LocalizedFrame& before, const LocalizedFrame& after,
                                             double time_s) {
  constexpr double kMaxGapS = 0.1;
  if (after.status != PlaceStatus::localized) return std::nullopt;
  PlaceHypothesis place = after.hypotheses.front();
  const double gap_s = after.tracked.time_s - before.tracked.time_s;
  if (after.tracked.time_s == time_s) return place;
  if (before.status != PlaceStatus::localized || before.tracked.trial != after.tracked.trial ||
      gap_s > kMaxGapS)
    return std::nullopt;
  place.map_T_sensor = interpolated(before.hypotheses.front().map_T_sensor, place.map_T_sensor,
                                    (time_s - before.tracked.time_s) / gap_s);
  return place;
}

std::vector<int> share_place(LocalizedFrame& first, const std::optional<PlaceHypothesis>& second,
                             const RigPose& rig) {
  const bool is_localized = first.status == PlaceStatus::localized;
  if (!second) return is_localized ? std::vector<int>{0} : std::vector<int>{};
  const PlaceHypothesis other = through(rig, *second);
  if (!is_localized) {
    first.status = PlaceStatus::localized;
    first.hypotheses = {other};
    first.reason.clear();
    return {1};
  }
  PlaceHypothesis& own = first.hypotheses.front();
  const Vector6d difference = se3_log(own.map_T_sensor.inverse() * other.map_T_sensor);
  const Matrix6d covariance = own.covariance + other.covariance;
  Matrix6d with_map = covariance;
  with_map.diagonal().head<3>().array() += kMapSigmaRad * kMapSigmaRad;
  with_map.diagonal().tail<3>().array() += kMapSigmaMm * kMapSigmaMm;
  if (std::sqrt(difference.dot(with_map.inverse() * difference)) > kMaxMismatch) {
    first.reason = fmt::format("the sensors contradict each other by {:.1f} mm and {:.1f} degrees",
                               difference.tail<3>().norm(), kDegreesPerRadian * difference.head<3>().norm());
    if (own.covariance.determinant() <= other.covariance.determinant()) return {0};
    own = other;
    return {1};
  }
  const Matrix6d gain = own.covariance * covariance.inverse();
  own.map_T_sensor = normalized(own.map_T_sensor * se3_exp(gain * difference));
  const Matrix6d left = own.covariance - gain * own.covariance;
  own.covariance = 0.5 * (left + left.transpose());
  own.probability = std::max(own.probability, other.probability);
  return {0, 1};
}

}  // namespace gelslam
