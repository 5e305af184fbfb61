#include "gelslam/evaluation/evaluation.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {
namespace {

constexpr int kTruthSamples = 100'000;
constexpr std::uint64_t kTruthSeed = 3;
constexpr double kMaxTimeMismatchFrames = 0.25;

/// Reads a run folder or a single .tum file. Throws Error when the trajectory is missing, empty or damaged.
RunFiles read_run(const std::filesystem::path& folder_or_tum) {
  if (!std::filesystem::exists(folder_or_tum))
    throw Error("there is no " + folder_or_tum.string() + ": give a run's folder or a .tum file");
  const bool is_folder = std::filesystem::is_directory(folder_or_tum);
  RunFiles run;
  if (is_folder) run = read_run_files(folder_or_tum);
  if (run.trajectory.empty())
    run.trajectory = read_tum(is_folder ? folder_or_tum / "trajectory.tum" : folder_or_tum);
  if (run.trajectory.empty())
    throw Error("the trajectory of " + folder_or_tum.string() + " is empty: nothing was tracked");
  return run;
}

bool has_several_logs(const RunFiles& run) { return run.report && run.report->logs.size() > 1; }

/// Returns the log frame whose sensor frame is the frame of trajectory and mesh.
std::optional<std::int64_t> anchor_frame(const RunFiles& run) {
  return run.report && run.report->anchor_frame >= 0 ? std::optional(run.report->anchor_frame) : std::nullopt;
}

void check_lengths(const GroundTruth& truth, const RunFiles& run) {
  if (!run.report) return;
  const RunReport& report = *run.report;
  // An interrupted run has processed only the beginning of its log.
  const bool saw_all = !report.partial && report.frames.left_out == 0 && !has_several_logs(run);
  if (saw_all && report.frames.total != truth.log_frames())
    throw Error("the run's log had " + std::to_string(report.frames.total) + " frames, the truth is for " +
                std::to_string(truth.log_frames()) + ": they do not belong together");
  if (report.anchor_frame >= truth.log_frames())
    throw Error("the run's anchor_frame " + std::to_string(report.anchor_frame) + " is beyond the log's " +
                std::to_string(truth.log_frames()) + " frames");
}

/// Returns for each time stamp of the run's first log the index in the truth. Frames of the background, which
/// the truth does not cover, are left out.
std::vector<IndexedPose> match_frames(const GroundTruth& truth, const RunFiles& run) {
  std::vector<IndexedPose> estimate;
  for (const StampedPose& pose : run.trajectory) {
    if (has_several_logs(run) && pose.time_s >= run.report->logs[1].first_time_s) continue;
    const double time_s = pose.time_s - run.start_s(), frame = time_s * truth.fps;
    if (std::abs(frame) > 1e9 || std::abs(frame - std::round(frame)) > kMaxTimeMismatchFrames) {
      throw Error("the trajectory's time " + std::to_string(time_s) + " s is no frame of a log at " +
                  std::to_string(truth.fps) + " frames per second: times count from the log's first frame");
    }
    const int index = static_cast<int>(std::lround(frame)) - truth.background_frames;
    if (index < 0) continue;
    if (index >= static_cast<int>(truth.start_T_currs.size())) {
      throw Error("the trajectory reaches frame " + std::to_string(index + truth.background_frames) +
                  ", but the truth ends after " + std::to_string(truth.log_frames()) +
                  " frames: it belongs to another log");
    }
    if (!estimate.empty() && estimate.back().index == index) {
      throw Error("the trajectory has two poses for frame " +
                  std::to_string(index + truth.background_frames));
    }
    estimate.push_back({index, pose.map_T_sensor});
  }
  return estimate;
}

MeshEvaluation evaluate_meshes(const PlacedMeshes& meshes, const std::vector<Eigen::Vector3d>& touched_mm,
                               ProgressSink* progress) {
  for (const auto& [name, mesh] : {std::pair{"mesh", &meshes.estimate}, {"true mesh", &meshes.truth}})
    if (const std::string warning = size_warning(*mesh); !warning.empty())
      throw Error(std::string("the ") + name + " " + warning);
  NoProgress silent;
  ProgressSink& steps = progress != nullptr ? *progress : silent;
  steps.begin("measuring the mesh", 3);  // The steps take about the same time.
  const TriangleScene estimate(meshes.estimate);
  const TriangleScene truth(meshes.truth);
  std::vector<Eigen::Vector3d> truth_points = touched_mm;
  if (truth_points.empty())
    truth_points = sample_points(sample_surface(meshes.truth, kTruthSamples, kTruthSeed));
  MeshEvaluation result;
  result.touched_only = !touched_mm.empty();
  result.area_mm2 = result.touched_only ? area_around(touched_mm, truth) : area_mm2(meshes.truth);
  result.at_known_pose = evaluate_mesh(estimate, truth, truth_points);
  steps.update(1);
  result.refinement = refine_rigidly(estimate, truth);
  steps.update(2);
  const TriangleScene refined(transformed(meshes.estimate, result.refinement.truth_T_estimate));
  result.refined = evaluate_mesh(refined, truth, truth_points);
  steps.update(3);
  steps.end();
  return result;
}

/// Interpolates between the two poses around a time, unless they are too far apart in time.
std::optional<Pose> pose_at(const std::vector<StampedPose>& trajectory, double time_s) {
  constexpr double kMaxGapS = 0.1;
  const auto after = std::ranges::lower_bound(trajectory, time_s, {}, &StampedPose::time_s);
  if (after == trajectory.end()) return std::nullopt;
  if (after->time_s == time_s) return after->map_T_sensor;
  if (after == trajectory.begin() || after->time_s - std::prev(after)->time_s > kMaxGapS) return std::nullopt;
  const StampedPose& before = *std::prev(after);
  const double share = (time_s - before.time_s) / (after->time_s - before.time_s);
  return before.map_T_sensor * se3_exp(share * se3_log(before.map_T_sensor.inverse() * after->map_T_sensor));
}

/// Matches by time: one true pose is interpolated for each pose of the run, with indices according to the
/// run's rate.
Comparison compare_with_trajectory(const std::filesystem::path& run, const std::filesystem::path& tum) {
  constexpr double kMaxFps = 1000;
  Comparison comparison;
  comparison.run = read_run(run);
  GroundTruth& truth = comparison.truth;
  const std::vector<StampedPose> measured = read_tum(tum), &poses = comparison.run.trajectory;
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < poses.size(); ++i) steps_s.push_back(poses[i].time_s - poses[i - 1].time_s);
  truth.fps = steps_s.empty() ? truth.fps : std::min(kMaxFps, 1 / quantile(steps_s, 0.5));
  truth.background_frames = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const int missing =
        i == 0 ? 0 : static_cast<int>(std::lround(std::clamp(steps_s[i - 1], 0.0, 2.0) * truth.fps)) - 1;
    truth.start_T_currs.resize(truth.start_T_currs.size() + static_cast<std::size_t>(std::max(0, missing)));
    comparison.estimate.push_back({static_cast<int>(truth.start_T_currs.size()), poses[i].map_T_sensor});
    truth.start_T_currs.push_back(pose_at(measured, poses[i].time_s));
    if (!truth.start_s && truth.start_T_currs.back()) truth.start_s = poses[i].time_s;
  }
  if (!truth.start_s)
    throw Error(tum.string() +
                ": no pose around any time of the run; are both in Unix time, or from one start?");
  return comparison;
}

/// Returns a warning if the run's motions agree with the true ones only in another notation of rotations.
/// Length and axis of the motion from pose to pose do not depend on the frame of reference.
std::string motion_warning(const Comparison& comparison) {
  const auto reordered = [](const Pose& pose) {  // The quaternion read as if qx qy qz qw were qw qx qy qz.
    const Eigen::Quaterniond q(pose.linear());
    return Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
  };
  double run_mm = 0, true_mm = 0, error_rad = 0, reordered_error_rad = 0;
  for (std::size_t i = 1; i < comparison.estimate.size(); ++i) {
    const IndexedPose &from = comparison.estimate[i - 1], &to = comparison.estimate[i];
    const auto &true_from = comparison.truth.start_T_currs[static_cast<std::size_t>(from.index)],
               &true_to = comparison.truth.start_T_currs[static_cast<std::size_t>(to.index)];
    if (!true_from || !true_to) continue;
    const Pose moved = from.map_T_sensor.inverse() * to.map_T_sensor,
               truly_moved = true_from->inverse() * *true_to;
    const Eigen::Quaterniond turned(moved.linear());
    run_mm += moved.translation().norm();
    true_mm += truly_moved.translation().norm();
    error_rad += turned.angularDistance(Eigen::Quaterniond(truly_moved.linear()));
    reordered_error_rad += turned.angularDistance(reordered(*true_from).inverse() * reordered(*true_to));
  }
  const double ratio = true_mm / run_mm;
  if (ratio > std::sqrt(1000) && std::isfinite(ratio))  // The ratio is nearer to 1000 than to 1.
    return "the true motions are " + std::to_string(std::lround(ratio)) +
           " times as long as the run's: are the true positions in millimeters? They have to be in meters";
  if (2 * reordered_error_rad < error_rad)
    return "the run turns as the truth would with another order of its quaternions: are they qw qx qy qz? "
           "They have to be qx qy qz qw";
  return "";
}

}  // namespace

Comparison compare(const std::filesystem::path& run, const std::filesystem::path& data_folder) {
  if (std::filesystem::is_regular_file(data_folder)) return compare_with_trajectory(run, data_folder);
  Comparison comparison;
  comparison.truth = read_ground_truth(data_folder);
  comparison.run = read_run(run);
  const GroundTruth& truth = comparison.truth;
  check_lengths(truth, comparison.run);
  comparison.estimate = match_frames(truth, comparison.run);
  std::optional<int> preferred;
  if (const auto anchor = anchor_frame(comparison.run))
    preferred = static_cast<int>(*anchor) - truth.background_frames;
  comparison.reference_index = choose_reference_index(comparison.estimate, truth.start_T_currs, preferred);
  const IndexedPose& reference =
      *std::ranges::find(comparison.estimate, comparison.reference_index, &IndexedPose::index);
  comparison.start_T_map =
      *truth.start_T_currs[static_cast<std::size_t>(reference.index)] * reference.map_T_sensor.inverse();
  return comparison;
}

std::optional<PlacedMeshes> place_meshes(const Comparison& comparison) {
  const GroundTruth& truth = comparison.truth;
  const std::filesystem::path mesh = comparison.run.mesh_file();
  if (mesh.empty() || truth.mesh_path.empty() || !truth.object_T_start) return std::nullopt;
  return PlacedMeshes{transformed(read_mesh(mesh), *truth.object_T_start * comparison.start_T_map),
                      read_mesh(truth.mesh_path)};
}

Evaluation evaluate(const Comparison& comparison, const std::optional<PlacedMeshes>& meshes,
                    ProgressSink* progress) {
  const GroundTruth& truth = comparison.truth;
  Evaluation evaluation;
  // The public system is evaluated in this way: the first frame is its anchor.
  const int first = choose_reference_index(comparison.estimate, truth.start_T_currs, std::nullopt);
  evaluation.trajectory = evaluate_trajectory(comparison.estimate, truth.start_T_currs, first, truth.fps);
  evaluation.reference_s = truth.start_s;
  if (!truth.start_s) evaluation.reference_frame = first + truth.background_frames;
  evaluation.anchor_frame = anchor_frame(comparison.run);
  if (const std::optional<RunReport>& report = comparison.run.report) {
    evaluation.trials = report->trials;
    evaluation.components = report->components;
  }
  if (truth.start_s) evaluation.trajectory_warning = motion_warning(comparison);
  if (meshes) evaluation.mesh = evaluate_meshes(*meshes, truth.touched_mm, progress);
  return evaluation;
}

std::string Evaluation::warning() const {
  if (!trajectory_warning.empty()) return trajectory_warning;
  // The distances to another object's surface may be small, too. The ratio of the two angles is 0.1 to 0.67
  // for the right surface and 0.78 to 1.1 for surfaces of other objects (seven runs, seven objects). On
  // smooth surfaces it tells nothing.
  constexpr double kMaxRatio = 0.72, kSmoothDeg = 5;
  if (!mesh || mesh->at_known_pose.normals_deg < kSmoothDeg ||
      mesh->at_known_pose.normals_deg < kMaxRatio * mesh->at_known_pose.normals_aside_deg)
    return "";
  return "the mesh's relief is not that of the true surface: is it the truth of this object and run?";
}

Evaluation evaluate(const PlacedMeshes& meshes, ProgressSink* progress) {
  Evaluation evaluation;
  evaluation.mesh = evaluate_meshes(meshes, {}, progress);
  return evaluation;
}

}  // namespace gelslam
