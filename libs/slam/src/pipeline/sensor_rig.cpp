#include "gelslam/slam/sensor_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
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

constexpr double kStepS = 0.02;  // numerics

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

}  // namespace

double start_of_second_s(const ScanRecord& first, const ScanRecord& second) {
  constexpr double kMaxOffsetS = 30, kMinCorrelation = 0.7, kClearlyBetter = 0.1;
  const TurnRates a = turn_rates(first), b = turn_rates(second);
  constexpr int kMost = static_cast<int>(kMaxOffsetS / kStepS);
  const Peak peak = peak_of(a, b, -kMost, kMost);
  if (peak.correlation < kMinCorrelation || peak.correlation < correlation(a, b, 0) + kClearlyBetter)
    return 0;
  return peak.lag * kStepS;
}

std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second,
                                           double second_start_s) {
  const std::map<int, Matrix6d> first_covariances = frame_covariances(first),
                                second_covariances = frame_covariances(second);
  std::vector<RigConstraint> constraints;
  std::optional<double> last_s;
  for (const FrameRecord& frame : first.frames) {
    if (!has_place(first, frame) || (last_s && frame.time_s < *last_s + 1 / kConstraintsPerS)) continue;
    const std::optional<Place> place = place_at(second, frame.time_s - second_start_s);
    if (!place) continue;
    const auto of_first = first_covariances.find(frame.keyframe),
               of_second = second_covariances.find(place->keyframe);
    if (of_first == first_covariances.end() || of_second == second_covariances.end()) continue;
    last_s = frame.time_s;
    constraints.push_back({frame.keyframe, place->keyframe, frame.keyframe_T_frame, place->keyframe_T_sensor,
                           of_observable(of_first->second, frame.observable),
                           of_observable(of_second->second, place->observable)});
  }
  return constraints;
}

}  // namespace gelslam
