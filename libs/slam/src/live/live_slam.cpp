#include "gelslam/slam/live_slam.hpp"

#include <atomic>
#include <exception>
#include <future>
#include <latch>
#include <thread>

#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "live/live_stages.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

/// Creates or continues the run folder; nothing if the scan is not saved.
std::optional<GrowingRun> run_of(const LiveOptions& options) {
  if (options.run_folder.empty()) return std::nullopt;
  const bool records = options.record.has_value();
  return options.continued
             ? resume_run(options.run_folder, *options.continued, options.log, records, options.config)
             : begin_run({options.run_folder, options.overwrite, options.log, records}, options.config);
}

std::unique_ptr<LogRecorder> recorder_of(const LiveOptions& options, const RawFrameSource& source,
                                         const std::filesystem::path& log) {
  LogRecorderOptions recorder;
  recorder.keep_free_bytes = options.keep_free_bytes;
  return std::make_unique<LogRecorder>(std::make_unique<LogWriter>(log, *options.record, source.rate_hz()),
                                       recorder);
}

/// A live scan: the stages, their threads and the queues between them.
class LiveSlam final : public LiveSession, private LiveContext {
 public:
  LiveSlam(std::unique_ptr<RawFrameSource> frames, const LiveOptions& live_options)
      : LiveContext(live_options, frames->description()), source_(std::move(frames)) {
    start();
  }
  ~LiveSlam() override {
    abort();
    join();
  }

  LiveStatus status() const override;
  std::shared_ptr<const FrameReport> touch() const override { return board.touch(); }
  std::shared_ptr<const MapSnapshot> map() const override { return board.map(); }
  std::shared_ptr<const MeshFeed> mesh() const override { return options.mesh_feed; }

  void set_paused(bool pause) override;
  void stop() override;
  void abort() override;
  RunReport wait() override;
  BackgroundFrames background_frames() const override { return surface_.background_frames(); }

 private:
  void start();
  void make_threads();
  void capture();
  void take_frames();
  void report_log();
  void finish();
  Run save(SlamMap map, bool partial, ProgressSink& progress);
  bool failed();
  void join();
  template <typename Work>
  void guarded(const Work& work);

  const LiveClock::time_point begin_ = LiveClock::now();
  std::unique_ptr<RawFrameSource> source_;
  SurfaceStage surface_{*this};
  TrackingStage tracking_{*this};
  FusionStage fusion_{*this};
  MappingStage mapping_{*this, fusion_};
  std::optional<GrowingRun> run_;
  std::unique_ptr<LogRecorder> recorder_;  // null: nothing is recorded
  std::atomic<bool> paused_{false}, leaves_out_{false}, stopped_{false};
  std::string session_warning_;  // Valid after written_: why the session is incomplete, or "".

  mutable std::mutex mutex_;  // Protects the members below.
  RunReport report_;
  std::exception_ptr failure_;
  std::string failure_in_words_;

  std::latch captured_{1};  // Counted down when capture has ended and the log is complete.
  std::latch mapped_{1};    // Counted down when the mapper has processed every keyframe.
  std::latch written_{1};   // Counted down when the session contains all measurements.
  std::jthread fusion_thread_;
  std::vector<std::jthread> threads_;
  // Starts the threads. If it is destroyed without a value, the waiting threads end.
  std::promise<void> ready_;
};

/// Runs a stage. An exception ends the scan, and the later stages save what they have.
template <typename Work>
void LiveSlam::guarded(const Work& work) {
  try {
    work();
  } catch (const std::exception& error) {
    board.warn(error.what());
    const std::lock_guard lock(mutex_);
    if (failure_) return;
    failure_ = std::current_exception();
    failure_in_words_ = error.what();
  }
}

/// Creates the threads before the run folder, so that no folder is left if a stage or a thread cannot be
/// created.
void LiveSlam::start() {
  make_threads();
  run_ = run_of(options);
  if (!so_far.parts.empty()) so_far.parts.pop_back();
  if (run_) so_far.parts.push_back(run_->part);
  slam.emplace(options.config.slam, so_far, &measured);
  if (run_ && options.record) recorder_ = recorder_of(options, *source_, run_->log);
  ready_.set_value();
}

void LiveSlam::make_threads() {
  const auto thread = [begin = ready_.get_future().share()](auto work) {
    return std::jthread([begin, work] {
      try {
        begin.get();
      } catch (const std::future_error&) {
        return;
      }
      work();
    });
  };
  threads_.push_back(thread([this] {
    guarded([this] { capture(); });
    board.source_ended();
    raw.close();
    if (recorder_) {
      recorder_->finish();
      report_log();  // Includes problems with the last frames.
    }
    captured_.count_down();
  }));
  threads_.push_back(thread([this] {
    lower_thread_priority();
    const auto say = [this](const std::string& problem) { board.warn_about("the session", problem); };
    if (run_) session_warning_ = run_->write_session(measured, say);
    measured.close();  // The queue has no reader any more.
    written_.count_down();
  }));
  threads_.push_back(thread([this] {
    guarded([this] { surface_.run(); });
    source_->stop();
    raw.close();
    surfaced.close();
  }));
  threads_.push_back(thread([this] {
    guarded([this] { tracking_.run(); });
    surfaced.close();
    keyframes.close();
    mapped_.wait();
    measured.close();
    written_.wait();
    // This is done here and not in the mapper's thread, whose priority is low, because now the user waits.
    guarded([this] { finish(); });
    fusion_.stop();
    board.set_phase(LivePhase::finished);
  }));
  fusion_thread_ = thread([this] {
    lower_thread_priority();
    guarded([this] { fusion_.run(); });
  });
  threads_.push_back(thread([this] {
    lower_thread_priority();
    guarded([this] { mapping_.run(); });
    source_->stop();  // If mapping failed early, further frames would be of no use.
    keyframes.close();
    mapped_.count_down();
  }));
}

/// If the source is lost, the scan ends as if the user had stopped it, and everything measured so far is
/// saved.
void LiveSlam::capture() {
  try {
    take_frames();
  } catch (const Error& error) {
    board.warn(error.what());
    lost = true;
  }
}

void LiveSlam::take_frames() {
  const auto has_begun = [this] { return stopped_ || !options.begins || options.begins(); };
  const bool can_wait = source_->hold(paused_);  // False for a camera.
  while (can_wait && !has_begun()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  while (std::optional<RawFrame> next = source_->next()) {
    const auto frame = std::make_shared<const RawFrame>(std::move(*next));
    board.frame_arrived(frame->arrived, source_->lost_frames());
    board.warn_about("the source", source_->warning());
    if (recorder_) {
      recorder_->push(frame);
      report_log();
    }
    if (leaves_out_ || !has_begun()) continue;
    // Images for the background are never dropped, however fast they arrive.
    if (options.drop_when_behind && board.phase() != LivePhase::background)
      board.count(&LiveStatus::dropped, static_cast<std::int64_t>(raw.push_newest(frame)));
    else
      raw.push(frame);
  }
  board.warn_about("the source", source_->warning());
}

/// When the disk is full, the log ends, but the scan goes on.
void LiveSlam::report_log() {
  const LogRecorderStatus status = recorder_->status();
  board.set_log_bytes(status.bytes);
  board.warn_about("the log", status.warning);
}

void LiveSlam::finish() {
  board.set_phase(LivePhase::finishing);
  BoardProgress progress(board);
  fusion_.stop();
  fusion_thread_.join();  // The preview must not publish after the saved map, and saving needs the memory.
  return_free_memory();
  SlamMap map;
  {
    const auto scope = timer.measure("finish/poses");
    map = slam->finish(!aborted, &progress, [this] { return aborted.load(); });
  }
  slam.reset();
  captured_.wait();
  const Run saved = save(std::move(map), aborted || lost || failed(), progress);
  if (options.mesh_feed) {
    board.show_saved(saved.map);
    options.mesh_feed->set_whole(saved.mesh);
  }
}

Run LiveSlam::save(SlamMap map, bool partial, ProgressSink& progress) {
  const LiveStatus status = board.status();
  RunReport known;
  if (const auto& log = options.record && run_ ? run_->log : options.log; !log.empty())
    known.log = std::filesystem::absolute(log).lexically_normal().string();
  known.log_description = status.source;
  known.warnings = status.warnings;
  known.partial = partial;
  known.live = {.rate_hz = status.rate_hz,
                .arrived = status.frames,
                .lost_by_camera = status.lost_by_camera,
                .dropped = status.dropped,
                .damaged = status.damaged};
  Run finished = finish_scan(options.config, std::move(map), std::move(known), timer, begin_, &progress);
  {
    const std::lock_guard lock(mutex_);
    report_ = finished.report;
  }
  board.set_state("saving");
  if (run_) {
    run_->save(finished, session_warning_);
    const std::lock_guard lock(mutex_);
    run_->put_in_place();
  }
  return finished;
}

bool LiveSlam::failed() {
  const std::lock_guard lock(mutex_);
  return failure_ != nullptr;
}

void LiveSlam::join() {
  for (std::jthread& thread : threads_)
    if (thread.joinable()) thread.join();
}

LiveStatus LiveSlam::status() const {
  LiveStatus status = board.status();
  if ((status.phase == LivePhase::background || status.phase == LivePhase::scanning) && paused_) {
    status.phase = LivePhase::paused;
    status.state = "paused";
    status.reason = status.advice = "";
  }
  if (std::string reason = source_->disconnect_reason(); !reason.empty()) {
    status.state = "the camera is away";
    status.reason = "";
    status.advice = std::move(reason);
    status.track = TrackStatus::lost;
  }
  const std::lock_guard lock(mutex_);
  if (run_) status.run_folder = run_->folder.string();
  status.failure = failure_in_words_;
  status.saved_drift_mm = report_.uncertainty.drift_mm.amount;
  status.saved_drift_deg = report_.uncertainty.drift_deg.amount;
  status.touched = describe(report_.touched);
  status.result_warnings = report_.result_warnings;
  return status;
}

void LiveSlam::set_paused(bool pause) {
  paused_ = pause;
  if (source_->hold(pause)) return;
  // A camera goes on sending, and the object may be elsewhere after the pause, so the trial is broken. Frames
  // that were already on their way to the tracker when the scan was paused still belong to the trial.
  if (leaves_out_.exchange(pause) && !pause) surfaced.push_beyond_limit(BreakTrial{});
}

void LiveSlam::stop() {
  stopped_ = true;
  source_->stop();
}

void LiveSlam::abort() {
  aborted = true;
  stop();
}

RunReport LiveSlam::wait() {
  join();
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  return report_;
}

}  // namespace

void check_run_folder(const LiveOptions& options) {
  if (!options.run_folder.empty() && !options.continued)
    check_run({options.run_folder, options.overwrite, options.log});
}

std::unique_ptr<LiveSession> begin_live_scan(std::unique_ptr<RawFrameSource> source,
                                             const LiveOptions& options) {
  return std::make_unique<LiveSlam>(std::move(source), options);
}

}  // namespace gelslam
