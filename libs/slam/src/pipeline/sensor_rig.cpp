#include "gelslam/slam/sensor_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/index.hpp"

namespace gelslam {
namespace {

constexpr double kConstraintsPerS = 5;  // neighbors in time share their errors
constexpr double kMaxGapS = 0.1;        // between two frames, to interpolate

/// A sensor's pose in one of its keyframes.
struct Place {
  int keyframe = -1;
  Pose keyframe_T_sensor = Pose::Identity();
  std::array<bool, 6> observable = {};  ///< FrameRecord::observable
};

/// By keyframe, how well a frame is known in it: as well as the keyframe that was tracked from it, or from
/// which it was tracked.
std::map<int, Matrix6d> frame_covariances(const ScanRecord& record) {
  std::map<int, Matrix6d> covariances;
  for (const PoseGraphEdge& edge : record.edges) {
    if (edge.kind != EdgeKind::odometry) continue;
    covariances[edge.from] = uncertain_motion(edge).covariance;
    covariances.try_emplace(edge.to, covariances[edge.from]);
  }
  return covariances;
}

/// Along axes that a surface does not show, noise alone gives an edge some information: there, a sensor is
/// known as well as frames that overlap.
Matrix6d of_observable(Matrix6d covariance, const std::array<bool, 6>& observable) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!observable[index(axis)]) covariance(axis + 3, axis + 3) += kOverlapSigmaMm * kOverlapSigmaMm;
    if (!observable[index(axis + 3)]) covariance(axis, axis) += kOverlapSigmaRad * kOverlapSigmaRad;
  }
  return covariance;
}

bool has_place(const ScanRecord& record, const FrameRecord& frame) {
  return frame.status == TrackStatus::tracked && record.has_keyframe(frame.keyframe);
}

/// Whether both refer to one keyframe, in one trial, and no picture between them is missing for long.
bool is_step(const ScanRecord& record, const FrameRecord& before, const FrameRecord& after) {
  return has_place(record, before) && has_place(record, after) && before.keyframe == after.keyframe &&
         before.trial == after.trial && after.time_s - before.time_s <= kMaxGapS;
}

/// Where the sensor was at this time, between two of its frames that refer to one keyframe.
std::optional<Place> place_at(const ScanRecord& record, double time_s) {
  const std::vector<FrameRecord>& frames = record.frames;
  const auto after =
      std::lower_bound(frames.begin(), frames.end(), time_s,
                       [](const FrameRecord& frame, double time) { return frame.time_s < time; });
  if (after == frames.end() || !has_place(record, *after)) return std::nullopt;
  if (after->time_s == time_s) return Place{after->keyframe, after->keyframe_T_frame, after->observable};
  // A keyframe is itself the frame at which it was made, so that the frame before refers to another one.
  if (after == frames.begin() || !is_step(record, *std::prev(after), *after)) return std::nullopt;
  const FrameRecord& before = *std::prev(after);
  const double gap_s = after->time_s - before.time_s;
  return Place{
      before.keyframe,
      interpolated(before.keyframe_T_frame, after->keyframe_T_frame, (time_s - before.time_s) / gap_s),
      after->observable};
}

/// Radians per second, in the middle of every kStepS from time 0 on; NaN where the sensor was not tracked.
using TurnRates = std::vector<double>;

constexpr double kStepS = 0.02, kMinCorrelation = 0.7;

TurnRates turn_rates(const ScanRecord& record) {
  TurnRates rates;
  for (std::size_t i = 1; i < record.frames.size(); ++i) {
    const FrameRecord &before = record.frames[i - 1], &after = record.frames[i];
    const double gap_s = after.time_s - before.time_s;
    if (gap_s <= 0 || !is_step(record, before, after)) continue;
    const double rate =
        rotation_angle_rad(before.keyframe_T_frame.inverse() * after.keyframe_T_frame) / gap_s;
    const auto begin = static_cast<std::size_t>(std::max(0.0, std::round(before.time_s / kStepS))),
               end = static_cast<std::size_t>(std::max(0.0, std::round(after.time_s / kStepS)));
    if (rates.size() < end) rates.resize(end, std::nan(""));
    for (std::size_t step = begin; step < end; ++step) rates[step] = rate;
  }
  return rates;
}

/// Of a(t) with b(t - lag), where both are known; 0 where that is for less than three seconds.
double correlation(const TurnRates& a, const TurnRates& b, int lag) {
  constexpr double kMinS = 3;
  double n = 0, sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  const int begin = std::max(0, lag),
            end = std::min(static_cast<int>(a.size()), static_cast<int>(b.size()) + lag);
  for (int i = begin; i < end; ++i) {
    const double x = a[index(i)], y = b[index(i - lag)];
    if (std::isnan(x) || std::isnan(y)) continue;
    n += 1;
    sum_a += x;
    sum_b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  const double variance_a = n * aa - sum_a * sum_a, variance_b = n * bb - sum_b * sum_b;
  if (n * kStepS < kMinS || variance_a <= 0 || variance_b <= 0) return 0;
  return (n * ab - sum_a * sum_b) / std::sqrt(variance_a * variance_b);
}

/// Where a parabola through the peak and its neighbors is highest, in steps from the peak.
double peak_between(const std::vector<double>& values, std::size_t peak) {
  if (peak == 0 || peak + 1 >= values.size()) return 0;
  const double before = values[peak - 1], after = values[peak + 1], bend = before - 2 * values[peak] + after;
  return bend < 0 ? 0.5 * (before - after) / bend : 0;
}

/// Where a(t) and b(t - lag) correlate best, in steps.
struct Peak {
  double lag = 0, correlation = -1;
};

Peak peak_of(const TurnRates& a, const TurnRates& b, int first_lag, int last_lag) {
  std::vector<double> correlations;
  std::size_t best = 0;
  for (int lag = first_lag; lag <= last_lag; ++lag) {
    correlations.push_back(correlation(a, b, lag));
    if (correlations.back() > correlations[best]) best = correlations.size() - 1;
  }
  return {first_lag + static_cast<double>(best) + peak_between(correlations, best), correlations[best]};
}

/// Means of 0.2 s: the noise of poses is most of what two frames differ by, and a drift changes little more.
TurnRates smoothed(const TurnRates& rates) {
  constexpr std::size_t kReach = 5;
  TurnRates means(rates.size(), std::nan(""));
  for (std::size_t i = kReach; i + kReach < rates.size(); ++i)
    means[i] = std::accumulate(&rates[i - kReach], &rates[i + kReach] + 1, 0.0) / (2 * kReach + 1);
  return means;
}

/// As a clock that goes at another rate would have recorded it.
TurnRates at_rate(const TurnRates& rates, double rate) {
  TurnRates stretched(static_cast<std::size_t>(static_cast<double>(rates.size() - 1) * rate));
  for (std::size_t step = 0; step < stretched.size(); ++step)
    stretched[step] = rates[static_cast<std::size_t>(std::lround(static_cast<double>(step) / rate))];
  return stretched;
}

/// The clock that explains the most, if that is clearly more than one at rate 1 does, near `steady`.
std::optional<SecondClock> drifting_clock(const TurnRates& a, const TurnRates& b, const Peak& steady) {
  constexpr double kMaxDrift = 0.003, kStepsAtEnds = 2;  // between two rates that are tried
  // Of the logarithm of the share that stays unexplained, times seconds. Without a drift, it stays below 2.
  constexpr double kMinEvidence = 4;
  if (steady.correlation <= 0) return std::nullopt;
  const double begin = std::max(0.0, -steady.lag),
               end = std::min(static_cast<double>(b.size()), static_cast<double>(a.size()) - steady.lag),
               length = end - begin, step = 2 * kStepsAtEnds / length;
  const int reach = 3 + static_cast<int>(0.25 * kMaxDrift * length),
            most = static_cast<int>(kMaxDrift / step);
  const auto peak_at = [&](double rate) {
    const int lag = static_cast<int>(std::lround(steady.lag + (1 - rate) * 0.5 * (begin + end)));
    return peak_of(a, at_rate(b, rate), lag - reach, lag + reach);
  };
  std::vector<double> correlations;
  for (int k = -most; k <= most; ++k) correlations.push_back(peak_at(1 + k * step).correlation);
  const auto best =
      static_cast<int>(std::max_element(correlations.begin(), correlations.end()) - correlations.begin());
  const double rate = 1 + step * (best - most + peak_between(correlations, index(best)));
  const Peak peak = peak_at(rate);
  const double unexplained =
      (1 - std::pow(correlations[index(most)], 2)) / (1 - std::pow(peak.correlation, 2));
  if (peak.correlation < kMinCorrelation || !(std::log(unexplained) * length * kStepS > kMinEvidence))
    return std::nullopt;
  return SecondClock{peak.lag * kStepS, rate};
}

}  // namespace

SecondClock second_clock(const ScanRecord& first, const ScanRecord& second) {
  constexpr double kMaxOffsetS = 30, kClearlyBetter = 0.1;
  const TurnRates a = turn_rates(first), b = turn_rates(second);
  constexpr int kMost = static_cast<int>(kMaxOffsetS / kStepS);
  const Peak peak = peak_of(a, b, -kMost, kMost);
  if (const auto drifting = drifting_clock(smoothed(a), smoothed(b), peak)) return *drifting;
  if (peak.correlation < kMinCorrelation || peak.correlation < correlation(a, b, 0) + kClearlyBetter)
    return {};
  return {peak.lag * kStepS};
}

RigPose GivenRig::pose_at(double time_s) const {
  return {Eigen::Translation3d(gripper.moved_mm(time_s)) * pose->first_T_second, pose->covariance};
}

Eigen::Vector3d Gripper::moved_mm(double time_s) const {
  const auto after =
      std::lower_bound(openings.begin(), openings.end(), time_s,
                       [](const Opening& opening, double time) { return opening.time_s < time; });
  if (openings.empty()) return Eigen::Vector3d::Zero();
  if (after == openings.begin() || after == openings.end())
    return axis * (after == openings.end() ? openings.back() : openings.front()).mm;
  const Opening& before = *std::prev(after);
  return axis * std::lerp(before.mm, after->mm, (time_s - before.time_s) / (after->time_s - before.time_s));
}

std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second,
                                           const SecondClock& clock, const Gripper& gripper) {
  const std::map<int, Matrix6d> first_covariances = frame_covariances(first),
                                second_covariances = frame_covariances(second);
  std::vector<RigConstraint> constraints;
  std::optional<double> last_s;
  for (const FrameRecord& frame : first.frames) {
    if (!has_place(first, frame) || (last_s && frame.time_s < *last_s + 1 / kConstraintsPerS)) continue;
    const std::optional<Place> place = place_at(second, clock.time_s(frame.time_s));
    if (!place) continue;
    const auto of_first = first_covariances.find(frame.keyframe),
               of_second = second_covariances.find(place->keyframe);
    if (of_first == first_covariances.end() || of_second == second_covariances.end()) continue;
    last_s = frame.time_s;
    constraints.push_back({frame.keyframe, place->keyframe, frame.keyframe_T_frame, place->keyframe_T_sensor,
                           of_observable(of_first->second, frame.observable),
                           of_observable(of_second->second, place->observable),
                           gripper.moved_mm(frame.time_s)});
  }
  return constraints;
}

}  // namespace gelslam
