// Study: how many of the loops that the chain believes are wrong, stage by stage, on data folders with truth;
// and how many of the keyframes that come back to a seen place are told so.
#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

constexpr double kWrongLoopMm = 0.5, kWrongLoopDeg = 3.0;
constexpr double kOverlap = 0.3;  // of the smaller contact: then a loop should be found

struct LoopsArguments {
  std::vector<std::filesystem::path> folders;
  std::filesystem::path model;
  bool list = false;
};

struct LoopScan {
  SlamOptions options;
  std::vector<NewKeyframe> keyframes;
  std::vector<FrameRecord> frames;
  std::vector<Pose> true_pose;  // of each keyframe

  const Keyframe& keyframe(int id) const { return *keyframes[static_cast<std::size_t>(id)].keyframe; }
};

LoopScan track(const std::filesystem::path& folder, const std::filesystem::path& model) {
  const GroundTruth truth = read_ground_truth(folder);
  const LogInput input{.log = folder, .config = {}, .model = model, .background = {}};
  const Config config = resolve_config(input);
  StageTimer timer;
  SurfaceStream stream(input, config, timer);
  Tracker tracker(config.slam.tracker, config.slam.registration, config.slam.verification);
  LoopScan scan;
  scan.options = config.slam;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    if (!item->surface) {
      scan.frames.push_back(background_record(item->frame, item->time_s));
      continue;
    }
    const TrackedFrame tracked = tracker.track(item->frame, item->time_s, item->surface);
    scan.frames.push_back(record_of(tracked));
    for (const NewKeyframe& added : tracked.new_keyframes) {
      const auto index = static_cast<std::size_t>(added.keyframe->frame - truth.background_frames);
      const std::optional<Pose> pose = truth.start_T_currs.at(index);
      if (!pose) throw Error(folder.string() + ": a keyframe has no true pose");
      scan.keyframes.push_back(added);
      scan.true_pose.push_back(*pose);
    }
  }
  return scan;
}

bool right(const LoopScan& scan, int from, int to, const Pose& from_T_to) {
  const Pose truth =
      scan.true_pose[static_cast<std::size_t>(from)].inverse() * scan.true_pose[static_cast<std::size_t>(to)];
  const Pose error = from_T_to.inverse() * truth;
  return error.translation().norm() < kWrongLoopMm &&
         rotation_angle_rad(error) < kWrongLoopDeg * M_PI / 180.0;
}

/// Pairs of keyframes, not neighbors in one trial, whose contacts share kOverlap of the smaller one where
/// they truly are.
std::vector<std::pair<int, int>> true_overlaps(const LoopScan& scan) {
  std::vector<std::pair<int, int>> pairs;
  for (int to = 0; to < static_cast<int>(scan.keyframes.size()); ++to)
    for (int from = 0; from < to; ++from) {
      const Keyframe &a = scan.keyframe(from), &b = scan.keyframe(to);
      if (a.trial == b.trial && from + 1 == to) continue;
      const Pose from_T_to = scan.true_pose[static_cast<std::size_t>(from)].inverse() *
                             scan.true_pose[static_cast<std::size_t>(to)];
      if (contact_overlap(*a.surface.get(), *b.surface.get(), from_T_to) >= kOverlap)
        pairs.emplace_back(from, to);
    }
  return pairs;
}

struct Count {
  int loops = 0, wrong = 0, keyframes = 0;  // keyframes that have a right one
};

template <typename Loops>
Count count(const LoopScan& scan, const Loops& loops) {
  Count result;
  std::vector<bool> seen(scan.keyframes.size(), false);
  for (const auto& loop : loops) {
    ++result.loops;
    if (right(scan, loop.from, loop.to, loop.from_T_to))
      seen[static_cast<std::size_t>(loop.to)] = true;
    else
      ++result.wrong;
  }
  result.keyframes = static_cast<int>(std::count(seen.begin(), seen.end(), true));
  return result;
}

std::vector<LoopConstraint> search(const LoopScan& scan, const SlamOptions& options) {
  LoopCloser closer(options.loop_closure, options.registration, options.verification);
  std::vector<LoopConstraint> all;
  for (const NewKeyframe& added : scan.keyframes)
    for (const LoopConstraint& loop : closer.add(*added.keyframe)) all.push_back(loop);
  return all;
}

SlamOptions as_published(SlamOptions options) {
  options.verification.max_self_similarity = 1.0;
  options.verification.min_texture_correlation = -1.0;
  options.verification.max_height_rmse_mm = 1e9;
  options.verification.max_free_space_violation = 1.0;
  return options;
}

std::vector<PoseGraphEdge> loops_of(const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& keep) {
  std::vector<PoseGraphEdge> loops;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (edges[i].kind == EdgeKind::loop && (keep.empty() || keep[i])) loops.push_back(edges[i]);
  return loops;
}

void print(const char* stage, const Count& count, std::size_t returning) {
  fmt::print("  {:<28} {:5} loops, {:4} wrong; keyframes with a right one: {}, returning {}\n", stage,
             count.loops, count.wrong, count.keyframes, returning);
}

void study(const std::filesystem::path& folder, const std::filesystem::path& model, bool list) {
  const LoopScan scan = track(folder, model);
  const std::vector<std::pair<int, int>> overlaps = true_overlaps(scan);
  std::vector<bool> returns(scan.keyframes.size(), false);
  for (const auto& [from, to] : overlaps) returns[static_cast<std::size_t>(to)] = true;
  const auto returning = static_cast<std::size_t>(std::count(returns.begin(), returns.end(), true));
  fmt::print("{}: {} keyframes, {} pairs overlap\n", name_of(folder), scan.keyframes.size(), overlaps.size());

  const std::vector<LoopConstraint> open = search(scan, as_published(scan.options));
  const std::vector<LoopConstraint> verified = search(scan, scan.options);
  print("SCR and CCS only", count(scan, open), returning);
  print("verified", count(scan, verified), returning);
  if (list)
    for (const LoopConstraint& loop : open)
      fmt::print("    {} {} {} trials {} {} inliers {} scr {:.2f} ccs {:.2f} texture {:.2f} rmse {:.3f}\n",
                 right(scan, loop.from, loop.to, loop.from_T_to) ? "right" : "WRONG", loop.from, loop.to,
                 scan.keyframe(loop.from).trial, scan.keyframe(loop.to).trial, loop.sift_inliers, loop.scr,
                 loop.ccs, loop.texture_correlation, loop.height_rmse_mm);

  Mapper mapper(scan.options);
  for (const NewKeyframe& added : scan.keyframes) mapper.add_keyframe(added);
  const SlamMap unrefined = mapper.finish(scan.frames, false, [] { return false; });
  print("consistent", count(scan, loops_of(unrefined.edges, {})), returning);
  const SlamMap map = mapper.finish(scan.frames, true, [] { return false; });
  std::vector<bool> inlier = map.solution.edge_outlier;
  inlier.flip();
  print("refined", count(scan, loops_of(map.edges, {})), returning);
  print("refined, without outliers", count(scan, loops_of(map.edges, inlier)), returning);
  fmt::print("  components {} of {} trials, gradient scale {:.3f} {:.3f}\n", map.components, map.trials,
             map.gradient_scale.x, map.gradient_scale.y);
  std::fflush(stdout);
}

void run(const LoopsArguments& arguments) {
  StudyCases cases(arguments.folders.size());
  for (const std::filesystem::path& folder : arguments.folders) {
    cases.begin(name_of(folder));
    study(folder, arguments.model, arguments.list);
  }
}

}  // namespace

void add_loops(CLI::App& lab) {
  const auto arguments = std::make_shared<LoopsArguments>();
  CLI::App* command =
      add_study(lab, "loops", "Count right and wrong loops on data folders with truth", arguments, run);
  command->add_option("DATA", arguments->folders, "Data folders with true_start_T_currs.npy")->required();
  command->add_option("--model", arguments->model, "Gradient model (default: the one that the folder names)");
  command->add_flag("--list", arguments->list, "Print every loop with its measures");
  command->footer("Example: gelslam-lab loops DATA/sequences/scan_* --list");
}

}  // namespace gelslam::lab
