#include "ablation_case.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

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
#include "gelslam/slam/trial_drift.hpp"

namespace gelslam::lab {
namespace {

using Clock = std::chrono::steady_clock;
using OptionalPose = std::optional<Pose>;

constexpr double kWrongMm = 1.0, kWrongDeg = 5.0;

/// The tracker alone, as `gelslam track` runs it: what its poses are worth the moment they are said. A frame
/// fails silently when along an axis that it calls observable it is more than 1 mm or 5 degrees off and
/// further than two of its own standard deviations.
class LiveTracking {
 public:
  explicit LiveTracking(const SlamOptions& options)
      : tracker_(options.tracker, options.registration, options.verification),
        drift_(options.gradient_scale.sigma) {}

  void process(const SurfaceStream::Item& item, const OptionalPose& start_T_frame) {
    const TrackedFrame tracked = tracker_.track(item.frame, item.time_s, item.surface);
    const std::optional<Matrix6d> covariance = drift_.add(tracked);
    if (tracked.status != TrackStatus::tracked) return;
    ++tracked_;
    if (!start_T_frame) return;
    if (tracked.trial != trial_) {
      trial_ = tracked.trial;
      first_ = {*start_T_frame, tracked.trial_T_frame};
    }
    const Pose truth = first_.start_T_frame.inverse() * *start_T_frame;
    const Pose estimate = first_.trial_T_frame.inverse() * tracked.trial_T_frame;
    judge(estimate.inverse() * truth, sigma_of(*covariance), tracked.registration.observable);
  }

  int tracked() const { return tracked_; }
  int silent() const { return silent_; }
  /// Median over the frames of the error over its standard deviation (root mean square over the observable
  /// axes): near 1 where the standard deviations are honest, larger where they are too small.
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
      if (sigma[axis] <= 0) continue;  // the first frame of a trial
      squares += std::pow(error[axis] / sigma[axis], 2);
      ++axes;
    }
    silent_ += is_wrong ? 1 : 0;
    if (axes > 0) errors_over_sigma_.push_back(std::sqrt(squares / axes));
  }

  Tracker tracker_;
  TrialDrift drift_;
  int trial_ = -1, tracked_ = 0, silent_ = 0;
  First first_;
  std::vector<double> errors_over_sigma_;
};

/// Of what surfaces depend on.
std::string surface_key(Config config) {
  config.slam = {};
  return write_config(config);
}

/// Of what LiveTracking depends on, for the same surfaces.
std::string live_key(Config config) {
  const SlamOptions slam = config.slam;
  config.slam = {};
  config.slam.tracker = slam.tracker;
  config.slam.registration = slam.registration;
  config.slam.verification = slam.verification;
  config.slam.gradient_scale.sigma = slam.gradient_scale.sigma;
  return write_config(config);
}

/// The whole chain of one variant, and its tracker alone (shared with variants that track alike).
struct Chain {
  Chain(const AblationCase& measured, std::string variant_name, const Config& chain_config,
        std::shared_ptr<LiveTracking> live_tracking)
      : variant(std::move(variant_name)),
        config(chain_config),
        slam(chain_config.slam, {.parts = {part_of(chain_config, measured.input.log)}}),
        live(std::move(live_tracking)) {}

  const std::string variant;
  const Config config;
  GelSlam slam;
  StageTimer timer;
  const std::shared_ptr<LiveTracking> live;
};

double total_ms(const StageTimer& timer, const std::vector<std::string>& stages) {
  double sum = 0;
  for (const StageStatistics& stage : timer.statistics())
    if (std::find(stages.begin(), stages.end(), stage.stage) != stages.end()) sum += stage.total_ms;
  return sum;
}

std::vector<IndexedPose> poses_of(const SlamMap& map, int background_frames) {
  std::vector<IndexedPose> poses;
  for (const FrameRecord& frame : map.frames)
    if (map.has_pose(frame) && frame.frame >= background_frames)
      poses.push_back({static_cast<int>(frame.frame) - background_frames,
                       map.anchor_T_keyframe(frame.keyframe) * frame.keyframe_T_frame});
  return poses;
}

/// The map's mesh against the true one, at the known pose.
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

Json row_of(const AblationCase& measured, const Chain& chain, const std::optional<GroundTruth>& truth,
            int frames, double surface_ms) {
  const Clock::time_point start = Clock::now();
  const SlamMap map = chain.slam.finish(/*refine=*/true);
  const double finish_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  const auto in_map = std::count_if(map.frames.begin(), map.frames.end(),
                                    [&](const FrameRecord& frame) { return map.has_pose(frame); });
  Json row = {{"set", measured.set},
              {"sequence", measured.sequence},
              {"model", measured.model},
              {"variant", chain.variant},
              {"frames", frames},
              {"tracked", chain.live->tracked()},
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
    add_map_errors(row, map, chain.config, *truth);
    row["silent"] = chain.live->silent();
    row["error_over_sigma"] = chain.live->error_over_sigma();
  }
  row["frame_ms"] = (surface_ms + total_ms(chain.timer, {"tracking", "loop closure"})) / std::max(1, frames);
  row["finish_ms"] = finish_ms / std::max(1, frames);
  return row;
}

/// Variants that have the same surfaces.
class Group {
 public:
  void add(const AblationCase& measured, const std::string& variant, const Config& config) {
    std::shared_ptr<LiveTracking>& live = live_[live_key(config)];
    if (!live) live = std::make_shared<LiveTracking>(config.slam);
    chains_.push_back(std::make_unique<Chain>(measured, variant, config, live));
  }

  /// Rows by variant.
  std::map<std::string, Json> measure(const AblationCase& measured) {
    const Config& config = chains_.front()->config;
    std::optional<GroundTruth> truth;
    if (std::filesystem::exists(truth_file(measured.input.log)))
      truth = read_ground_truth(measured.input.log);
    StageTimer timer;
    SurfaceStream stream(measured.input, config, timer);
    int frames = 0;
    while (const std::optional<SurfaceStream::Item> item = stream.next()) {
      frames += item->surface ? 1 : 0;
      push(*item, truth);
    }
    std::map<std::string, Json> rows;
    for (const auto& chain : chains_)
      rows[chain->variant] = row_of(measured, *chain, truth, frames, total_ms(timer, {"surface"}));
    return rows;
  }

 private:
  void push(const SurfaceStream::Item& item, const std::optional<GroundTruth>& truth) {
    for (const auto& chain : chains_) {
      if (item.surface)
        chain->slam.process(item.frame, item.time_s, item.surface, chain->timer);
      else
        chain->slam.skip(item.frame, item.time_s);
    }
    if (!item.surface) return;
    OptionalPose pose;
    if (truth)
      pose = truth->start_T_currs.at(static_cast<std::size_t>(item.frame - truth->background_frames));
    for (const auto& [key, live] : live_) live->process(item, pose);
  }

  std::map<std::string, std::shared_ptr<LiveTracking>> live_;
  std::vector<std::unique_ptr<Chain>> chains_;
};

}  // namespace

Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants) {
  std::map<std::string, std::vector<std::pair<std::string, Config>>> by_surfaces;
  for (const Variant& variant : variants) {
    const Config config = with_settings(measured.config, variant);
    by_surfaces[surface_key(config)].emplace_back(variant.name, config);
  }
  std::map<std::string, Json> rows;
  for (const auto& [key, members] : by_surfaces) {
    Group group;
    for (const auto& [variant, config] : members) group.add(measured, variant, config);
    rows.merge(group.measure(measured));
  }
  Json in_order = Json::array();
  for (const Variant& variant : variants) in_order.push_back(rows.at(variant.name));
  return in_order;
}

}  // namespace gelslam::lab
