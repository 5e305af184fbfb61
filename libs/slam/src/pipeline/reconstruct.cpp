// Reconstructs a recorded log: computes the surface of each frame, tracks the frames and builds the map
// (GelSlam), optimizes all poses (GelSlam::finish), fuses the mesh (finish_scan) and writes the run folder.
// The methods are those of Huang et al. (NormalFlow and GelSLAM); this file connects them.
//
// Three threads run in parallel. One computes surfaces, the calling thread tracks them and searches for
// loops, and one writes what was measured to the session file. No frame is dropped, so the result does not
// depend on the speed of the threads. If the log continues a run, its frame numbers and times continue those
// of that run.

#include "gelslam/slam/reconstruct.hpp"

#include <future>
#include <memory>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

/// Tracks the whole log with `slam` and returns whether it was stopped early. Surfaces are computed on
/// another thread, while earlier ones are tracked and loops are searched for.
bool track_log(SurfaceStream& stream, GelSlam& slam, const ScanRecord& so_far, StageTimer& timer,
               ProgressSink& progress, const std::function<bool()>& stop_requested) {
  progress.begin("tracking", stream.frame_count());
  // Tracking pauses while the loops of a keyframe are searched for, which takes as long as computing ten to
  // twenty surfaces. The queue lets the other thread continue meanwhile. A queued surface takes 1.7 MB.
  BoundedQueue<SurfaceStream::Item> surfaces{12};
  std::future<void> all_made = std::async(std::launch::async, [&] {
    const QueueCloser<SurfaceStream::Item> closer{surfaces};
    while (std::optional<SurfaceStream::Item> item = stream.next()) {
      item->image.bgr.release();
      if (!surfaces.push(*std::move(item))) return;
    }
  });
  // This ends the thread above even if an exception leaves this function.
  const QueueCloser<SurfaceStream::Item> end{surfaces};
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

/// Begins the report with what the stream knows about the log.
RunReport report_of(const SurfaceStream& stream, const std::filesystem::path& log) {
  RunReport report;
  report.log = std::filesystem::absolute(log).lexically_normal().string();
  report.log_description = stream.description();
  report.warnings = stream.background_warnings();
  if (std::string warning = stream.warning(); !warning.empty()) report.warnings.push_back(std::move(warning));
  report.frames.left_out = stream.left_out();
  return report;
}

}  // namespace

Run reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested) {
  const auto start = std::chrono::steady_clock::now();
  const Config& config = request.config;
  const std::filesystem::path &log = request.input.log, &continued_run = request.continued_run;
  const NewRun wanted{.folder = request.run_folder,
                      .overwrite = request.overwrite,
                      .input = log,
                      .continued_run = continued_run};
  const bool is_kept = !request.run_folder.empty();
  if (is_kept) check_run(wanted);
  StageTimer timer;
  ScanRecord so_far;
  if (!continued_run.empty()) so_far = continue_scan(continued_run, config, log);
  SurfaceStream stream(request.input, config, timer);
  if (continued_run.empty()) so_far.parts = {part_of(config, log)};
  std::optional<GrowingRun> folder;
  // GelSlam adds items beyond the limit of this queue, so that tracking never waits for the disk.
  SessionQueue measured{1};
  std::future<std::string> session_warning;
  if (is_kept) {
    folder = begin_run(wanted, config, so_far.next_frame());
    session_warning =
        std::async(std::launch::async, [&] { return folder->write_session(measured, [](const auto&) {}); });
  }
  const QueueCloser<std::function<void(Store&)>> end{measured};
  auto slam = std::make_unique<GelSlam>(config.slam, so_far, is_kept ? &measured : nullptr);
  const bool stopped = track_log(stream, *slam, so_far, timer, progress, stop_requested);
  measured.close();
  SlamMap map;
  {
    const auto scope = timer.measure("finish/poses");
    // After a stop during tracking, what was tracked is still refined completely. A stop during the
    // refinement leaves out the rest of it.
    map = slam->finish(/*refine=*/true, &progress, [&] { return !stopped && stop_requested(); });
  }
  slam.reset();  // Frees the memory of the tracker and of the index of places before the mesh is fused.
  RunReport report = report_of(stream, log);
  report.partial = stopped || stop_requested();
  Run run = finish_scan(config, std::move(map), std::move(report), timer, start, &progress);
  if (is_kept) {
    folder->save(run, session_warning.get());
    folder->put_in_place();
  }
  return run;
}

void save_run(const std::filesystem::path& path, const Run& run, bool overwrite) {
  RunFolder folder(path, {.overwrite = overwrite, .inputs = {run.report.log}});
  write_run(folder.path(), run);
  folder.commit();
}

}  // namespace gelslam
