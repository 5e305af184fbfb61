#include "ablation_case.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/median.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"
#include "judgement.hpp"

namespace gelslam::lab {
namespace {

using Clock = std::chrono::steady_clock;
using OptionalPose = std::optional<Pose>;

/// Evaluates the tracker's poses at the time at which they are reported. A frame has an undetected error if,
/// along an axis reported as observable, it is more than 1 mm or 5 degrees off and further than two of its
/// own standard deviations.
class LiveTracking {
 public:
  explicit LiveTracking(const SlamOptions& options) : map_(options.gradient_scale) {}

  void judge(const TrackedFrame& tracked, const OptionalPose& start_T_frame) {
    const std::optional<MapPlace> place = map_.add(tracked);
    if (tracked.status != TrackStatus::tracked) return;
    ++tracked_;
    if (!start_T_frame) return;
    if (tracked.trial != trial_) {
      trial_ = tracked.trial;
      first_ = {*start_T_frame, tracked.trial_T_frame};
    }
    const Pose truth = first_.start_T_frame.inverse() * *start_T_frame;
    const Pose estimate = first_.trial_T_frame.inverse() * tracked.trial_T_frame;
    judge(estimate.inverse() * truth, sigma_of(place->map_T_frame.covariance),
          tracked.registration.observable);
  }

  int tracked() const { return tracked_; }
  int undetected() const { return undetected_; }
  /// Returns the median over the frames of error over standard deviation (root mean square over the
  /// observable axes). It is near 1 if the standard deviations are consistent, and larger if they are too
  /// small.
  double error_over_sigma() const { return median(errors_over_sigma_); }

 private:
  struct First {
    Pose start_T_frame, trial_T_frame;
  };

  void judge(const Pose& gap, const Vector6d& sigma, const std::array<bool, 6>& observable) {
    Vector6d error;
    error << gap.translation(), so3_log(gap.linear());
    bool is_wrong = false;
    double squares = 0;
    int axes = 0;
    for (int axis = 0; axis < 6; ++axis) {
      if (!observable[static_cast<std::size_t>(axis)]) continue;
      const double limit = axis < 3 ? kWrongMm : kWrongDeg / kDegreesPerRadian;
      is_wrong = is_wrong || std::abs(error[axis]) > std::max(limit, 2 * sigma[axis]);
      if (sigma[axis] <= 0) continue;  // This is the case in the first frame of a trial.
      squares += std::pow(error[axis] / sigma[axis], 2);
      ++axes;
    }
    undetected_ += is_wrong ? 1 : 0;
    if (axes > 0) errors_over_sigma_.push_back(std::sqrt(squares / axes));
  }

  TrialMap map_;
  int trial_ = -1, tracked_ = 0, undetected_ = 0;
  First first_;
  std::vector<double> errors_over_sigma_;
};

double total_ms(const StageTimer& timer, const std::vector<std::string>& stages) {
  double sum = 0;
  for (const StageStatistics& stage : timer.statistics())
    if (std::find(stages.begin(), stages.end(), stage.stage) != stages.end()) sum += stage.total_ms;
  return sum;
}

/// Returns the error of the map's mesh compared with the true one, at the known pose.
double mesh_error_mm(const SlamMap& map, const Config& config, const GroundTruth& truth,
                     const Pose& start_T_map) {
  const Mesh mesh = fuse_map(map, config.slam.fusion);
  if (mesh.triangles.empty()) return std::nan("");
  const TriangleScene estimate(transformed(mesh, *truth.object_T_start * start_T_map));
  return evaluate_mesh(estimate, TriangleScene(read_mesh(truth.mesh_path)), truth.touched_mm)
      .accuracy.mean_mm;
}

void add_map_errors(Json& row, const SlamMap& map, const Config& config, const GroundTruth& truth) {
  const std::vector<IndexedPose> poses = poses_of(map, truth.background_frames);
  const auto is_known = [&](const IndexedPose& pose) {
    return truth.start_T_currs.at(static_cast<std::size_t>(pose.index)).has_value();
  };
  if (std::none_of(poses.begin(), poses.end(), is_known)) {
    row["share"] = 0.0;
    return;
  }
  const int first = choose_reference_index(poses, truth.start_T_currs, std::nullopt);
  const TrajectoryMetrics errors = evaluate_trajectory(poses, truth.start_T_currs, first, truth.fps);
  row["share"] = errors.tracked_share();
  row["error_mm"] = errors.geometric_mean_mm;
  if (truth.mesh_path.empty() || !truth.object_T_start) return;
  const int reference = choose_reference_index(poses, truth.start_T_currs,
                                               static_cast<int>(map.anchor_frame) - truth.background_frames);
  for (const IndexedPose& pose : poses)
    if (pose.index == reference)
      row["mesh_mm"] = mesh_error_mm(
          map, config, truth,
          *truth.start_T_currs[static_cast<std::size_t>(reference)] * pose.map_T_sensor.inverse());
}

/// Runs the complete system for one variant.
Json measure(const AblationCase& measured, const std::string& variant, const Config& config) {
  std::optional<GroundTruth> truth;
  if (std::filesystem::exists(truth_file(measured.input.log))) truth = read_ground_truth(measured.input.log);
  GelSlam slam(config.slam, {.parts = {part_of(config, measured.input.log)}});
  LiveTracking live(config.slam);
  StageTimer timer;
  SurfaceStream stream(measured.input, config, timer);
  int frames = 0;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    if (!item->surface) {
      slam.process(item->image.index, item->image.time_s, nullptr, timer);
      continue;
    }
    ++frames;
    OptionalPose pose;
    if (truth)
      pose = truth->start_T_currs.at(static_cast<std::size_t>(item->image.index - truth->background_frames));
    live.judge(slam.process(item->image.index, item->image.time_s, item->surface, timer), pose);
  }
  slam.end_trial(timer);
  const Clock::time_point start = Clock::now();
  const SlamMap map = slam.finish();
  const double finish_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  const auto in_map = std::count_if(map.frames.begin(), map.frames.end(),
                                    [&](const FrameRecord& frame) { return map.has_pose(frame); });
  Json row = {{"set", measured.set},
              {"sequence", measured.sequence},
              {"model", measured.model},
              {"variant", variant},
              {"frames", frames},
              {"tracked", live.tracked()},
              {"in_map", in_map},
              {"share", static_cast<double>(in_map) / std::max(1, frames)},
              {"trials", map.trials},
              {"pieces", map.components},
              {"keyframes", map.keyframes.size()},
              {"loops", map.loops},
              {"error_mm", nullptr},
              {"mesh_mm", nullptr},
              {"silent", nullptr},
              {"error_over_sigma", nullptr}};
  if (truth) {
    add_map_errors(row, map, config, *truth);
    row["silent"] = live.undetected();
    row["error_over_sigma"] = live.error_over_sigma();
  }
  row["frame_ms"] = total_ms(timer, {"surface", "tracking", "loop closure"}) / std::max(1, frames);
  row["finish_ms"] = finish_ms / std::max(1, frames);
  return row;
}

}  // namespace

Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants) {
  Json rows = Json::array();
  for (const Variant& variant : variants)
    rows.push_back(measure(measured, variant.name, with_settings(measured.config, variant)));
  return rows;
}

}  // namespace gelslam::lab
