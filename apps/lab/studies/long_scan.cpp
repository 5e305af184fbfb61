// Study: cost of a long scan. A scan with interruptions of contact is simulated image by image without
// storing it, and processed like a log. Reported along the scan: keyframes, time and memory; at its end:
// loops, components, errors compared with the truth, and the time for the final solve.

#include <sys/resource.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <future>
#include <iostream>
#include <optional>
#include <thread>
#include <vector>

#include "gelslam/core/process.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "judgement.hpp"
#include "simulated_frames.hpp"
#include "study.hpp"
#include "terminal_progress.hpp"

namespace gelslam::lab {
namespace {

constexpr double kSize = 3.3;  // Scale of the pebble, which is 21 mm long.
constexpr int kReports = 20;   // Number of rows of the table.

struct LongScanArguments {
  int frames = 5000;
  std::filesystem::path out;
};

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// The frames of a simulation in order; some are rendered in advance on other threads.
class Pictures {
 public:
  explicit Pictures(const Simulator& simulator) : simulator_(simulator) {}

  std::optional<SimulatedFrame> next() {
    while (drawn_.size() < ahead_ && next_ < simulator_.frame_count())
      drawn_.push_back(std::async(std::launch::async, [this, i = next_++] { return simulator_.frame(i); }));
    if (drawn_.empty()) return std::nullopt;
    SimulatedFrame frame = drawn_.front().get();
    drawn_.pop_front();
    return frame;
  }

 private:
  const Simulator& simulator_;
  const std::size_t ahead_ = std::thread::hardware_concurrency();
  int next_ = 0;
  std::deque<std::future<SimulatedFrame>> drawn_;
};

/// Sums since the last row of the table.
struct Stretch {
  int frames = 0, tracked = 0, lost = 0, keyframes = 0;
  // frame_ms is the time of frames without a new keyframe.
  double surface_ms = 0, frame_ms = 0, keyframe_ms = 0;

  Json row(std::int64_t frame, int all_keyframes, int trials, double memory_before_mb) const {
    const auto mean = [](double sum, int count) { return count > 0 ? Json(sum / count) : Json(); };
    return {{"frames", frame},
            {"trials", trials},
            {"keyframes", all_keyframes},
            {"new_keyframes", keyframes},
            {"lost", lost},
            {"surface_ms", mean(surface_ms, frames)},
            {"tracking_ms", mean(frame_ms, frames - keyframes)},
            {"keyframe_ms", mean(keyframe_ms, keyframes)},
            {"frame_ms", mean(surface_ms + frame_ms + keyframe_ms, frames)},
            {"memory_mb", resident_memory_mb() - memory_before_mb}};
  }
};

struct Scan {
  std::vector<std::optional<Pose>> truth;
  Json rows = Json::array();
  int keyframes = 0, trials = 0, wrong_frames = 0;
  double memory_before_mb = resident_memory_mb();  // Memory of the simulation.
};

/// Says whether the pose of the frame relative to its keyframe is wrong.
bool is_wrong(const TrackedFrame& tracked, const std::vector<std::optional<Pose>>& truth) {
  if (tracked.status != TrackStatus::tracked) return false;
  const auto at = [&](std::int64_t frame) { return truth[static_cast<std::size_t>(frame)]; };
  const std::optional<Pose> keyframe = at(tracked.keyframe->frame), frame = at(tracked.frame);
  if (!keyframe || !frame) return false;
  const Pose error = tracked.keyframe_T_frame.inverse() * keyframe->inverse() * *frame;
  return error.translation().norm() > kWrongMm || rotation_angle_rad(error) > kWrongDeg * M_PI / 180.0;
}

/// Processes all frames with `slam`, and records the truth and the costs.
Scan run_scan(const Simulator& simulator, const std::filesystem::path& out, GelSlam& slam) {
  SurfaceEstimator estimator(flat_sensor_model(), simulator.frame(0).bgr, {});
  Pictures pictures(simulator);
  StageTimer timer;
  Scan scan;
  Stretch stretch;
  const std::unique_ptr<ProgressSink> progress = make_progress(false);
  progress->begin("scanning", simulator.frame_count());
  const int per_row = std::max(1, simulator.frame_count() / kReports);
  while (std::optional<SimulatedFrame> frame = pictures.next()) {
    scan.truth.push_back(frame->start_T_sensor);
    if (frame->index < simulator.spec().background_frames) {
      slam.process(frame->index, frame->time_s, nullptr, timer);
      continue;
    }
    const double start = thread_cpu_ms();
    const SurfacePtr surface = estimator.estimate(frame->bgr);
    const double estimated = thread_cpu_ms();
    const TrackedFrame tracked = slam.process(frame->index, frame->time_s, surface, timer);
    const int made = static_cast<int>(tracked.new_keyframes.size());
    stretch.surface_ms += estimated - start;
    (made > 0 ? stretch.keyframe_ms : stretch.frame_ms) += thread_cpu_ms() - estimated;
    stretch.keyframes += made;
    stretch.lost += tracked.status == TrackStatus::lost;
    scan.keyframes += made;
    scan.wrong_frames += is_wrong(tracked, scan.truth);
    scan.trials = std::max(scan.trials, tracked.trial + 1);
    if (++stretch.frames == per_row || frame->index + 1 == simulator.frame_count()) {
      scan.rows.push_back(stretch.row(frame->index + 1, scan.keyframes, scan.trials, scan.memory_before_mb));
      write_study(out, "long_scan", scan.rows);
      stretch = {};
    }
    progress->update(frame->index + 1);
  }
  progress->end();
  return scan;
}

/// Returns the distance between the reconstruction and the object, at the pose of the anchor.
Json mesh_errors(const Mesh& mesh, const Simulator& simulator, const Pose& object_T_map) {
  if (mesh.triangles.empty()) return {{"mesh_mm", nullptr}};
  const MeshMetrics metrics =
      evaluate_mesh(TriangleScene(transformed(mesh, object_T_map)), TriangleScene(simulator.surface()), {});
  return {{"mesh_mm", metrics.accuracy.mean_mm}, {"triangles", mesh.triangles.size()}};
}

Json summary(const Simulator& simulator, const Scan& scan, const SlamOptions& options, const GelSlam& slam) {
  Json result = {{"frames", scan.truth.size()}, {"memory_mb", resident_memory_mb() - scan.memory_before_mb}};
  const double start = wall_s();
  const SlamMap map = slam.finish();
  const double closed = wall_s();
  const Mesh mesh = fuse_map(map, options.fusion);
  const double fused = wall_s();
  result.update({{"peak_memory_mb", peak_memory_mb() - scan.memory_before_mb},
                 {"closing_s", closed - start},
                 {"fusion_s", fused - closed},
                 {"keyframes", scan.keyframes},
                 {"trials", map.trials},
                 {"components", map.components},
                 {"loops", map.loops}});
  const std::vector<IndexedPose> poses = poses_of(map, 0);
  const int reference = choose_reference_index(poses, scan.truth, static_cast<int>(map.anchor_frame));
  const TrajectoryMetrics errors =
      evaluate_trajectory(poses, scan.truth, reference, simulator.spec().motion.frame_rate_hz);
  result.update({{"tracked_share", errors.tracked_share()},
                 {"wrong_frames", scan.wrong_frames},
                 {"drift_mm", errors.ate_mm},
                 {"drift_aligned_mm", errors.ate_aligned_mm},
                 {"at_end_mm", errors.final_mm},
                 {"at_end_deg", errors.final_deg}});
  if (reference == map.anchor_frame)
    result.update(
        mesh_errors(mesh, simulator,
                    simulator.start_T_object().inverse() * *scan.truth[static_cast<std::size_t>(reference)]));
  return result;
}

/// Returns the scan with the object as a mesh file, which is the ground truth: rendering a procedural shape
/// would take ten times as long as tracking an image.
ScanSpec spec_of(const LongScanArguments& arguments) {
  constexpr float kSpacingMm = 0.25F;  // four pixels
  ShapeSpec object;
  object.size = kSize;
  write_study(arguments.out, "long_scan", Json::array());
  write_mesh(arguments.out / "object.ply", make_shape(object)->mesh(kSpacingMm), LengthUnit::meter);
  ScanSpec scan;
  scan.object.name = (arguments.out / "object.ply").string();
  scan.motion.name = "tour";
  scan.motion.frames = arguments.frames;
  return scan;
}

void run(const LongScanArguments& arguments) {
  const Simulator simulator(spec_of(arguments));
  const SlamOptions options;
  GelSlam slam(options);
  const double ready = wall_s();
  const Scan scan = run_scan(simulator, arguments.out, slam);
  const double scanned = wall_s();
  print_csv(scan.rows);
  Json row = summary(simulator, scan, options, slam);
  row["scanning_s"] = scanned - ready;
  for (const auto& [key, value] : row.items()) std::cout << key << " " << value.dump() << "\n";
  write_study(arguments.out, "long_scan_summary", Json::array({row}));
}

}  // namespace

void add_long_scan(CLI::App& lab) {
  const auto arguments = std::make_shared<LongScanArguments>();
  CLI::App* command =
      add_study(lab, "long-scan", "Simulate a long scan: keyframes, time, memory and errors", arguments, run);
  command->add_option("--frames", arguments->frames, "Frames, 25 a second")
      ->check(CLI::Range(100, 200'000))
      ->capture_default_str();
  command->add_option("-o,--output", arguments->out, "Folder for the tables and the object")->required();
  command->footer("Example: gelslam-lab long-scan --frames 5000 -o STUDY && scripts/plot_long_scan.py STUDY");
}

}  // namespace gelslam::lab
