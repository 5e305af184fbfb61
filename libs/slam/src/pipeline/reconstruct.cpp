#include "gelslam/slam/reconstruct.hpp"

#include <future>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {
namespace {

/// Feeds the whole log to `slam`; true when stopped before its end. Surfaces are made on a thread of their
/// own while earlier ones are tracked and loops are searched.
bool track_log(SurfaceStream& stream, GelSlam& slam, const ScanRecord& so_far, StageTimer& timer,
               ProgressSink& progress, const std::function<bool()>& stop_requested) {
  progress.begin("tracking", stream.frame_count());
  // A keyframe's loops take as long as ten to twenty surfaces, of 1.7 MB each.
  BoundedQueue<SurfaceStream::Item> surfaces{12};
  std::future<void> all_made = std::async(std::launch::async, [&] {
    const QueueCloser end{surfaces};
    while (std::optional<SurfaceStream::Item> item = stream.next()) {
      item->image.bgr.release();
      if (!surfaces.push(*std::move(item))) return;
    }
  });
  const QueueCloser end{surfaces};  // its thread ends, whatever happens here
  std::int64_t done = 0;
  bool stopped = false;
  while (const auto item = stopped ? std::nullopt : surfaces.pop()) {
    const TactileImage& image = item->image;
    slam.process(so_far.next_frame() + image.index, so_far.next_time_s() + image.time_s, item->surface, timer,
                 image.unix_us);
    progress.update(++done);
    stopped = stop_requested();
  }
  if (!stopped) all_made.get();
  slam.end_trial(timer);
  progress.end();
  return stopped;
}

std::vector<std::string> warnings_of(const SurfaceStream& stream) {
  std::vector<std::string> warnings = stream.background_doubts();
  if (std::string warning = stream.warning(); !warning.empty()) warnings.push_back(std::move(warning));
  return warnings;
}

}  // namespace

Run reconstruct(const LogInput& input, const Config& config, ProgressSink& progress,
                const std::function<bool()>& stop_requested, const std::filesystem::path& continued_run) {
  const auto start = std::chrono::steady_clock::now();
  StageTimer timer;
  ScanRecord so_far;
  if (!continued_run.empty()) so_far = continue_scan(continued_run, config, input.log);
  SurfaceStream stream(input, config, timer);
  if (continued_run.empty()) so_far.parts = {part_of(config, input.log)};
  GelSlam slam(config.slam, so_far);
  const bool stopped = track_log(stream, slam, so_far, timer, progress, stop_requested);
  SlamMap map;
  {
    const auto scope = timer.measure("finish/poses");
    // Stopped while tracking: what was seen is refined all the same. Stopped now: the rest is left out.
    map = slam.finish(/*refine=*/true, &progress, [&] { return !stopped && stop_requested(); });
  }
  RunReport report;
  report.log = std::filesystem::absolute(input.log).lexically_normal().string();
  report.log_description = stream.description();
  report.partial = stopped || stop_requested();
  report.warnings = warnings_of(stream);
  report.frames.left_out = stream.left_out();
  return finish_scan(config, std::move(map), std::move(report), timer, start, &progress);
}

void save_run(const std::filesystem::path& path, const Run& run, bool overwrite) {
  RunFolder folder(path, {.overwrite = overwrite, .inputs = {run.report.log}});
  write_run(folder.path(), run);
  folder.commit();
}

Run reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested) {
  RunFolder folder(request.run_folder,
                   {.overwrite = request.overwrite, .inputs = {request.input.log, request.continued_run}});
  Run run = reconstruct(request.input, request.config, progress, stop_requested, request.continued_run);
  write_run(folder.path(), run);
  folder.commit();
  return run;
}

}  // namespace gelslam
