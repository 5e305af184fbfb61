#include "gelslam/slam/live_slam.hpp"

#include <atomic>
#include <exception>
#include <future>
#include <latch>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/slam/pose_stream.hpp"
#include "live/live_fusion.hpp"
#include "live/live_mapping.hpp"
#include "live/live_surface.hpp"
#include "live/live_tracking.hpp"
#include "run_folder/live_run.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

// What is older than this is not worth its latency.
constexpr std::size_t kQueuedFrames = 2;

/// Half of the time is left for tracking. Without drops searches may take any time, and the result is that of
/// the offline program.
std::optional<double> relocalization_share(const LiveOptions& options) {
  if (!options.drop_when_behind) return std::nullopt;
  return 0.5;
}

/// Null: nothing is kept.
std::shared_ptr<LiveRun> run_of(const LiveOptions& options) {
  if (options.run_folder.empty()) return nullptr;
  const bool records = options.record.has_value();
  return options.continued
             ? LiveRun::resume(options.run_folder, *options.continued, options.log, records, options.config)
             : LiveRun::begin(options.run_folder, options.overwrite, options.log, records, options.config);
}

std::unique_ptr<LogRecorder> recorder_of(const LiveOptions& options, const RawFrameSource& source,
                                         const std::filesystem::path& log) {
  LogRecorderOptions recorder;
  if (options.record_resized) recorder.resize_to = {options.config.sensor};
  return std::make_unique<LogRecorder>(std::make_unique<LogWriter>(log, *options.record, source.rate_hz()),
                                       recorder);
}

}  // namespace

struct LiveSlam::Impl {
  Impl(std::unique_ptr<RawFrameSource> frames, const LiveOptions& live_options)
      : options(live_options),
        source(std::move(frames)),
        board(source->description()),
        so_far(options.continued ? options.continued->record : ScanRecord{}),
        surface(options, board, timer),
        tracking(options.config.slam, relocalization_share(options), so_far, options.stream.get(), measured,
                 board, timer),
        mapping(options.config.slam, timer),
        fusion(options.config.slam.fusion, board, timer) {}

  void start();
  void make_threads();
  void capture();
  void take_frames();
  void report_log();
  void map_keyframes();
  void write_session();
  void save_for_now(const SaveSoFar& so_far);
  void finish();
  Run save(SlamMap map, bool partial, ProgressSink* progress);
  bool failed();
  void join();
  template <typename Work>
  void guarded(const Work& work);

  const LiveOptions options;
  const LiveClock::time_point begin = LiveClock::now();
  std::unique_ptr<RawFrameSource> source;
  StageTimer timer;
  SessionQueue measured{1};  // its limit is never asked for
  LiveBoard board;
  ScanRecord so_far;  // of a new scan its part alone
  SurfaceStage surface;
  TrackingStage tracking;
  MappingStage mapping;
  FusionStage fusion;
  std::shared_ptr<LiveRun> run;
  std::unique_ptr<LogRecorder> recorder;  // null: nothing is recorded

  RawQueue raw{kQueuedFrames};
  TrackerQueue surfaced{kQueuedFrames};
  MapperQueue keyframes{1};  // its limit is never asked for: the tracker goes beyond it
  std::atomic<bool> paused{false}, leaves_out{false}, aborted{false}, stopped{false}, lost{false},
      saving{false}, session_is_whole{true};

  std::mutex mutex;  // for what follows
  RunReport report;
  std::exception_ptr failure;
  std::string failure_in_words;

  std::latch captured{1};  // nothing more comes, and the log is whole
  std::latch mapped{1};    // the mapper has seen every keyframe
  std::latch written{1};   // the session holds all that was measured
  std::jthread fusion_thread;
  std::vector<std::jthread> threads;
  std::promise<void> ready;  // when it goes without having been kept, threads that wait for it end
};

/// Whatever goes wrong in a stage ends the scan, and the stages behind it save what they have.
template <typename Work>
void LiveSlam::Impl::guarded(const Work& work) {
  try {
    work();
  } catch (const std::exception& error) {
    board.warn(error.what());
    const std::lock_guard lock(mutex);
    if (failure) return;
    failure = std::current_exception();
    failure_in_words = error.what();
  }
}

/// Stages and threads that cannot begin leave no folder.
void LiveSlam::Impl::start() {
  make_threads();
  run = run_of(options);
  if (!so_far.parts.empty()) so_far.parts.pop_back();
  if (run) so_far.parts.push_back(run->part());
  if (run && options.record) recorder = recorder_of(options, *source, run->log());
  ready.set_value();
}

void LiveSlam::Impl::make_threads() {
  const auto thread = [begin = ready.get_future().share()](auto work) {
    return std::jthread([begin, work] {
      try {
        begin.get();
      } catch (const std::future_error&) {
        return;
      }
      work();
    });
  };
  threads.push_back(thread([this] {
    guarded([this] { capture(); });
    board.source_ended();
    raw.close();
    if (recorder) {
      recorder->finish();
      report_log();  // what went wrong with the last frames, too
    }
    captured.count_down();
  }));
  threads.push_back(thread([this] {
    lower_thread_priority();
    if (run) write_session();
    measured.close();  // nobody reads it
    written.count_down();
  }));
  threads.push_back(thread([this] {
    guarded([this] { surface.run(raw, surfaced); });
    source->stop();
    raw.close();
    surfaced.close();
  }));
  threads.push_back(thread([this] {
    guarded([this] { tracking.run(surfaced, keyframes); });
    surfaced.close();
    keyframes.close();
    mapped.wait();
    measured.close();
    written.wait();
    // Here and not in the mapper's thread, whose priority is low: now a person waits.
    guarded([this] { finish(); });
    fusion.stop();
    board.set_phase(LivePhase::finished);
  }));
  fusion_thread = thread([this] {
    lower_thread_priority();
    guarded([this] { fusion.run(); });
  });
  threads.push_back(thread([this] {
    lower_thread_priority();
    guarded([this] { map_keyframes(); });
    source->stop();  // if that failed early: nothing would be made of further frames,
    keyframes.close();
    while (keyframes.try_pop()) {  // and nobody may wait for an answer
    }
    mapped.count_down();
  }));
}

/// A source that is lost ends the scan like a person would: with all that was seen.
void LiveSlam::Impl::capture() {
  try {
    take_frames();
  } catch (const Error& error) {
    board.warn(error.what());
    lost = true;
  }
}

void LiveSlam::Impl::take_frames() {
  const auto has_begun = [this] { return stopped || !options.begins || options.begins(); };
  while (!options.log.empty() && !has_begun()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  while (std::optional<RawFrame> next = source->next()) {
    const auto frame = std::make_shared<const RawFrame>(std::move(*next));
    board.frame_arrived(frame->arrived, source->lost_frames());
    board.warn_about("the source", source->warning());
    if (recorder) {
      recorder->push(frame);
      report_log();
    }
    if (leaves_out || !has_begun()) continue;
    // What the background needs is waited for, however fast frames come.
    if (options.drop_when_behind && board.phase() != LivePhase::background)
      board.frames_dropped(static_cast<std::int64_t>(raw.push_newest(frame)));
    else
      raw.push(frame);
  }
  board.warn_about("the source", source->warning());
}

/// A full disk ends the log, not the scan.
void LiveSlam::Impl::report_log() {
  const LogRecorderStatus status = recorder->status();
  board.set_log_bytes(status.bytes);
  board.warn_about("the log", status.warning);
}

void LiveSlam::Impl::map_keyframes() {
  const auto found = [this](int keyframe, std::vector<PoseGraphEdge> loops) {
    measured.push_beyond_limit(
        [keyframe, loops = std::move(loops)](Store& store) { store.add_loops(keyframe, loops); });
  };
  mapping.restore(so_far, found);
  mapping.run(
      keyframes, aborted, found,
      [this](std::shared_ptr<const MapSnapshot> map) {
        if (options.stream) options.stream->write_map(*map);
        if (options.show_mesh) fusion.set_map(map);
        board.set_map(std::move(map));
      },
      [this](const SaveSoFar& so_far) { save_for_now(so_far); });
}

/// A full disk ends the session, not the scan.
void LiveSlam::Impl::write_session() {
  try {
    Store store(run->folder());
    if (options.continued) store.add(run->part());
    while (const std::optional<SessionWork> work = measured.pop()) (*work)(store);
    store.flush();
  } catch (const std::exception& error) {  // whatever it is, the scan goes on
    board.warn(error.what());
    session_is_whole = false;
  }
}

/// Not being able to save is no reason to end a scan.
void LiveSlam::Impl::save_for_now(const SaveSoFar& so_far) {
  try {
    SlamMap map = mapping.finish(so_far.records, [this] { return stopped.load(); });
    save(std::move(map), true, nullptr);
  } catch (const std::exception& error) {
    board.warn(error.what());
  }
  saving = false;
}

void LiveSlam::Impl::finish() {
  board.set_phase(LivePhase::finishing);
  BoardProgress progress(board);
  SlamMap map;
  {
    const auto scope = timer.measure("finish/poses");
    map = mapping.finish(
        tracking.records(), [this] { return aborted.load(); }, &progress);
  }
  fusion.stop();
  fusion_thread.join();  // what it drew must not come after what is saved
  captured.wait();
  const Run saved = save(std::move(map), aborted || lost || failed(), &progress);
  if (options.show_mesh) board.show_saved(saved.map, saved.mesh);
  board.set_words(run ? "done: saved in " + run->folder().string() : "done", TrackStatus::background);
}

Run LiveSlam::Impl::save(SlamMap map, bool partial, ProgressSink* progress) {
  const LiveStatus status = board.status();
  RunReport known;
  if (const auto& log = options.record && run ? run->log() : options.log; !log.empty())
    known.log = std::filesystem::absolute(log).lexically_normal().string();
  known.log_description = status.source;
  known.warnings = status.warnings;
  known.partial = partial;
  known.live = {status.rate_hz, status.frames, status.lost_by_camera, status.dropped, status.damaged};
  Run finished = finish_scan(options.config, std::move(map), std::move(known), timer, begin, progress);
  {
    const std::lock_guard lock(mutex);
    report = finished.report;
  }
  if (progress) board.set_words("saving", TrackStatus::background);
  if (run) run->save(finished, session_is_whole);
  return finished;
}

bool LiveSlam::Impl::failed() {
  const std::lock_guard lock(mutex);
  return failure != nullptr;
}

void LiveSlam::Impl::join() {
  for (std::jthread& thread : threads)
    if (thread.joinable()) thread.join();
}

void check_run_folder(const LiveOptions& options) {
  if (!options.run_folder.empty() && !options.continued)
    LiveRun::check(options.run_folder, options.overwrite, options.log);
}

LiveSlam::LiveSlam(std::unique_ptr<RawFrameSource> source, const LiveOptions& options)
    : impl_(std::make_unique<Impl>(std::move(source), options)) {
  impl_->start();
}

LiveSlam::~LiveSlam() {
  abort();
  impl_->join();
}

LiveStatus LiveSlam::status() const {
  LiveStatus status = impl_->board.status();
  if ((status.phase == LivePhase::background || status.phase == LivePhase::scanning) && impl_->paused) {
    status.phase = LivePhase::paused;
    status.words = "paused";
  }
  status.saving = impl_->saving;
  if (impl_->run) status.run_folder = impl_->run->folder().string();
  const std::lock_guard lock(impl_->mutex);
  status.failure = impl_->failure_in_words;
  status.drift_mm = impl_->report.uncertainty.drift_mm.amount;
  status.drift_deg = impl_->report.uncertainty.drift_deg.amount;
  status.reservations = impl_->report.reservations;
  return status;
}

std::shared_ptr<const LiveTouch> LiveSlam::touch() const { return impl_->board.touch(); }
std::shared_ptr<const MapSnapshot> LiveSlam::map() const { return impl_->board.map(); }
MeshChanges LiveSlam::take_mesh_changes() { return impl_->board.take_mesh_changes(); }
std::vector<StageStatistics> LiveSlam::stage_times() const { return impl_->timer.statistics(); }

void LiveSlam::set_paused(bool paused) {
  impl_->paused = paused;
  if (impl_->source->hold(paused)) return;
  // A camera goes on, and the object may be elsewhere when the scan does. What was on its way to the tracker
  // when it was paused still belongs to the trial.
  if (impl_->leaves_out.exchange(paused) && !paused) impl_->surfaced.push_beyond_limit(BreakTrial{});
}
void LiveSlam::undo_last_trial() { impl_->surfaced.push_beyond_limit(UndoTrial{}); }
void LiveSlam::save_now() {
  if (!impl_->run) return;
  impl_->saving = true;
  impl_->surfaced.push_beyond_limit(SaveNow{});
}

void LiveSlam::stop() {
  impl_->stopped = true;
  impl_->source->stop();
}

void LiveSlam::abort() {
  impl_->aborted = true;
  stop();
}

RunReport LiveSlam::wait() {
  impl_->join();
  const std::lock_guard lock(impl_->mutex);
  if (impl_->failure) std::rethrow_exception(impl_->failure);
  return impl_->report;
}

BackgroundFrames LiveSlam::background_frames() const { return impl_->surface.background_frames(); }

}  // namespace gelslam
