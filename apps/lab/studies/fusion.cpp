// Study: what the live mesh costs. The keyframes of a run are added one by one, as in a scan; then, so that
// the map grows further, the same ones again elsewhere. Printed: time per keyframe early and late, moving
// everything as after a loop, fuse() on the same patches, and memory. One thread; processor time.

#include "gelslam/fusion/fusion.hpp"

#include <fmt/core.h>
#include <malloc.h>
#include <time.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/slam/session.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

struct FusionArguments {
  std::filesystem::path run;
  std::size_t keyframes = 100;
};

/// Processor time of this thread: a busy machine does not spoil it.
double now_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double allocated_mb() { return static_cast<double>(mallinfo2().uordblks + mallinfo2().hblkhd) / 1e6; }

/// As many keyframes as wanted: those of the run, then the same beside them, and so on.
std::vector<PosedSurface> repeated(const std::vector<PosedSurface>& patches, std::size_t count) {
  constexpr double apart_mm = 200;
  std::vector<PosedSurface> result;
  for (std::size_t i = 0; i < count; ++i) {
    PosedSurface patch = patches[i % patches.size()];
    patch.id = static_cast<int>(i);
    patch.map_T_keyframe.translation().x() += apart_mm * static_cast<double>(i / patches.size());
    result.push_back(patch);
  }
  return result;
}

struct Cost {
  double ms = 0, longest_call_ms = 0;
  std::size_t blocks = 0, triangles = 0;
};

/// Until nothing is left to do, with what a viewer does besides.
Cost run_until_done(IncrementalFusion& fusion, const std::vector<PosedSurface>& patches,
                    double gradient_scale) {
  Cost cost;
  const double start = now_ms();
  fusion.set_patches(patches, gradient_scale);
  for (bool more = true; more;) {
    const double call = now_ms();
    more = fusion.work();
    cost.longest_call_ms = std::max(cost.longest_call_ms, now_ms() - call);
    for (const MeshBlock& block : fusion.take_changed_blocks()) {
      ++cost.blocks;
      cost.triangles += block.mesh.triangles.size();
    }
  }
  cost.ms = now_ms() - start;
  return cost;
}

void print_costs(const char* name, std::vector<Cost> costs) {
  if (costs.empty()) return;
  double longest_call = 0;
  std::size_t blocks = 0;
  for (const Cost& c : costs) {
    longest_call = std::max(longest_call, c.longest_call_ms);
    blocks += c.blocks;
  }
  std::sort(costs.begin(), costs.end(), [](const Cost& a, const Cost& b) { return a.ms < b.ms; });
  const std::size_t n = costs.size();
  fmt::print("{:<30} median {:6.1f} ms, 95 % {:6.1f}, max {:6.1f}; longest call {:5.1f}; {} blocks each\n",
             name, costs[n / 2].ms, costs[n * 95 / 100].ms, costs.back().ms, longest_call, blocks / n);
}

void run(const FusionArguments& arguments) {
  const std::filesystem::path& run = arguments.run;
  const std::filesystem::path folder = exists(run / "session") ? run / "session" : run;
  const Session session = load_session(folder);
  if (session.patches.empty()) throw Error(run.string() + ": the session has no keyframes");
  const std::vector<PosedSurface> patches = repeated(session.patches, arguments.keyframes);
  FusionOptions options;
  options.gradient_scale = session.gradient_scale;
  options.threads = 1;
  const double start = now_ms();
  const Mesh mesh = fuse(patches, options);
  fmt::print("{} keyframes ({} of the run)\n{:<30} {:.0f} ms, {} triangles\n", patches.size(),
             session.patches.size(), "fuse()", now_ms() - start, mesh.triangles.size());

  const double before_mb = allocated_mb();
  IncrementalFusion fusion(options, {});
  std::vector<Cost> costs;
  for (std::size_t n = 1; n <= patches.size(); ++n) {
    costs.push_back(run_until_done(
        fusion, {patches.begin(), patches.begin() + static_cast<std::ptrdiff_t>(n)}, options.gradient_scale));
  }
  const auto quarter = static_cast<std::ptrdiff_t>(std::max<std::size_t>(1, costs.size() / 4));
  print_costs("a new keyframe, first quarter", {costs.begin(), costs.begin() + quarter});
  print_costs("a new keyframe, last quarter", {costs.end() - quarter, costs.end()});
  fmt::print("{:<30} {:.2f} MB per keyframe\n", "memory",
             (allocated_mb() - before_mb) / static_cast<double>(patches.size()));

  std::vector<PosedSurface> moved = patches;
  for (PosedSurface& patch : moved) patch.map_T_keyframe.translation() += Eigen::Vector3d(0.05, 0.05, 0.05);
  print_costs("all moved by 0.09 mm", {run_until_done(fusion, moved, options.gradient_scale)});
  print_costs("gradient scale changed by 1 %",
              {run_until_done(fusion, moved, options.gradient_scale * 1.01)});
  IncrementalFusion afresh(options, {});
  print_costs("all at once", {run_until_done(afresh, patches, options.gradient_scale)});
}

}  // namespace

void add_fusion(CLI::App& lab) {
  const auto arguments = std::make_shared<FusionArguments>();
  CLI::App* command =
      add_study(lab, "fusion", "Time the growing mesh on the keyframes of a run", arguments, run);
  command->add_option("RUN", arguments->run, "Run folder, or its session")->required();
  command
      ->add_option("--keyframes", arguments->keyframes, "Number of keyframes; those of the run are repeated")
      ->check(CLI::Range(1, 100000));
  command->footer("Example: gelslam-lab fusion RUN --keyframes 2000");
}

}  // namespace gelslam::lab
