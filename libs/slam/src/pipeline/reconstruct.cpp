#include "gelslam/slam/reconstruct.hpp"

#include <chrono>

#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {
namespace {

using Clock = std::chrono::steady_clock;

/// Feeds the whole log to `slam`; true when stopped before its end.
bool track_log(SurfaceStream& stream, GelSlam& slam, StageTimer& timer, ProgressSink& progress,
               const std::function<bool()>& stop_requested) {
  progress.begin("tracking", stream.frame_count());
  bool stopped = false;
  std::int64_t done = 0;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    if (item->surface)
      slam.process(item->frame, item->time_s, item->surface, timer);
    else
      slam.skip(item->frame, item->time_s);
    progress.update(++done);
    if (stop_requested()) {
      stopped = true;
      break;
    }
  }
  progress.end();
  return stopped;
}

std::string warnings_of(const SurfaceStream& stream) {
  std::string text;
  for (const std::string& doubt : stream.background_doubts()) text += (text.empty() ? "" : "; ") + doubt;
  const std::string about_log = stream.warning();
  return text + (text.empty() || about_log.empty() ? "" : "; ") + about_log;
}

}  // namespace

ReconstructSummary reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                               const std::function<bool()>& stop_requested) {
  const Clock::time_point start = Clock::now();
  RunFolder folder(
      request.run_folder,
      {.overwrite = request.overwrite, .known_entries = run_entries(), .input = request.input.log});
  StageTimer timer;
  SurfaceStream stream(request.input, request.config, timer);
  GelSlam slam(request.config.slam);
  const bool partial = track_log(stream, slam, timer, progress, stop_requested);

  SlamMap map;
  {
    progress.begin("closing loops", std::nullopt);
    const auto scope = timer.measure("finish/poses");
    map = slam.finish();
    progress.end();
  }
  Mesh mesh;
  {
    progress.begin("fusing", std::nullopt);
    const auto scope = timer.measure("finish/fusion");
    mesh = fuse_map(map, request.config.slam.fusion);
    progress.end();
  }

  ReconstructSummary summary = summarise(map, mesh);
  summary.partial = partial;
  summary.warning = warnings_of(stream);
  summary.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  write_run(folder.path(), request.config, map, mesh,
            {request.program_version, request.input.log, stream.description(), timer.statistics(), summary,
             std::nullopt});
  folder.commit();
  return summary;
}

}  // namespace gelslam
