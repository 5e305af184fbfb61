#include "gelslam/slam/reconstruct.hpp"

#include <chrono>

#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {
namespace {

using Clock = std::chrono::steady_clock;

/// Feeds the whole log to `slam`; true when stopped before its end.
bool track_log(SurfaceStream& stream, GelSlam& slam, const ContinuedScan& scan, StageTimer& timer,
               ProgressSink& progress, const std::function<bool()>& stop_requested) {
  progress.begin("tracking", stream.frame_count());
  bool stopped = false;
  std::int64_t done = 0;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    const std::int64_t frame = scan.first_frame + item->frame;
    const double time_s = scan.first_time_s + item->time_s;
    if (item->surface)
      slam.process(frame, time_s, item->surface, timer);
    else
      slam.skip(frame, time_s);
    progress.update(++done);
    if (stop_requested()) {
      stopped = true;
      break;
    }
  }
  progress.end();
  return stopped;
}

std::vector<std::string> warnings_of(const SurfaceStream& stream, std::vector<std::string> warnings) {
  for (const auto& more : {stream.background_doubts(), stream.warnings()})
    warnings.insert(warnings.end(), more.begin(), more.end());
  return warnings;
}

RunFolderOptions folder_options(std::vector<std::filesystem::path> inputs, bool overwrite) {
  return {.overwrite = overwrite, .inputs = std::move(inputs)};
}

void commit_run(RunFolder& folder, const Run& run) {
  write_run(folder.path(), run.config, run.map, run.mesh, run.account);
  folder.commit();
}

}  // namespace

Run map_log(const LogInput& input, const Config& config, ProgressSink& progress,
            const std::function<bool()>& stop_requested, const std::filesystem::path& continued_run,
            StageTimer& timer) {
  ContinuedScan scan;
  if (!continued_run.empty()) scan = continue_scan(continued_run, config, input.log);
  SurfaceStream stream(input, config, timer);
  if (continued_run.empty()) scan.record.parts = {part_of(config, input.log)};
  GelSlam slam(config.slam, &scan);
  const bool partial = track_log(stream, slam, scan, timer, progress, stop_requested);
  Run run{config, {}, {}, {}};
  {
    const auto scope = timer.measure("finish/poses");
    run.map = slam.finish(/*refine=*/true, &progress);
  }
  run.account = {input.log, stream.description(), {}, {}, std::nullopt};
  run.account.summary.partial = partial;
  run.account.summary.warnings = warnings_of(stream, scan.record.warnings);
  return run;
}

Run reconstruct(const LogInput& input, const Config& config, ProgressSink& progress,
                const std::function<bool()>& stop_requested, const std::filesystem::path& continued_run) {
  const Clock::time_point start = Clock::now();
  StageTimer timer;
  Run run = map_log(input, config, progress, stop_requested, continued_run, timer);
  {
    const auto scope = timer.measure("finish/fusion");
    run.mesh = fuse_map(run.map, config.slam.fusion, &progress);
  }
  run.account.times = timer.statistics();
  ReconstructSummary summary = summarize(run.map, run.mesh);
  summary.partial = run.account.summary.partial;
  summary.warnings = run.account.summary.warnings;
  summary.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  run.account.summary = std::move(summary);
  return run;
}

void save_run(const std::filesystem::path& path, const Run& run, bool overwrite) {
  RunFolder folder(path, folder_options({run.account.log}, overwrite));
  commit_run(folder, run);
}

ReconstructSummary reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                               const std::function<bool()>& stop_requested) {
  RunFolder folder(request.run_folder,
                   folder_options({request.input.log, request.continued_run}, request.overwrite));
  const Run run = reconstruct(request.input, request.config, progress, stop_requested, request.continued_run);
  commit_run(folder, run);
  return run.account.summary;
}

}  // namespace gelslam
