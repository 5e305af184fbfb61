#include "gelslam/slam/live_rig.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "live/live_fusion.hpp"
#include "live/rig_view.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

constexpr std::array<const char*, 2> kNames = {"first sensor", "second sensor"};

std::string of_sensor(std::size_t sensor, const std::string& sentence) {
  return std::string(kNames[sensor]) + ": " + sentence;
}

/// A sensor that has ended does not hold up the other one.
LivePhase phase_of_both(LivePhase first, LivePhase second) {
  const LivePhase phase = std::min(first, second);
  return phase == LivePhase::finished ? LivePhase::finishing : phase;
}

/// What frames of this sensor have come to.
void add_sensor(LiveStatus& all, const LiveStatus& one, std::size_t sensor) {
  for (const std::string& warning : one.warnings) all.warnings.push_back(of_sensor(sensor, warning));
  if (!one.failure.empty()) append_sentence(all.failure, of_sensor(sensor, one.failure));
  append_sentence(all.source, one.source);
  all.saving = all.saving || one.saving;
  all.frames += one.frames;
  all.lost_by_camera += one.lost_by_camera;
  all.dropped += one.dropped;
  all.damaged += one.damaged;
  all.latency_ms = std::max(all.latency_ms, one.latency_ms);
  all.log_bytes += one.log_bytes;
}

LiveOptions without_mesh(LiveOptions options) {
  options.show_mesh = false;
  return options;
}

/// Each has a LiveSlam and a run folder of its own, so that one goes on when the other is lost.
class LiveRig final : public LiveSession {
 public:
  LiveRig(RawFrameSources sources, const std::vector<LiveOptions>& options, const LiveRigOptions& rig)
      : options_(rig),
        show_mesh_(options[0].show_mesh),
        fusion_(options[0].config.slam.fusion, board_, timer_),
        first_(std::move(sources[0]), without_mesh(options[0])),
        second_(std::move(sources[1]), without_mesh(options[1])),
        view_(known_) {
    fusion_thread_ = std::jthread([this] { fuse(); });
    thread_ = std::jthread([this] { run(); });
  }
  ~LiveRig() override {
    LiveRig::abort();
    if (thread_.joinable()) thread_.join();
  }

  LiveStatus status() const override;
  std::shared_ptr<const LiveTouch> touch() const override {
    const std::lock_guard lock(mutex_);
    return view_.touch();
  }
  std::vector<std::shared_ptr<const LiveTouch>> touches() const override {
    return {first_.touch(), second_.touch()};
  }
  std::shared_ptr<const MapSnapshot> map() const override { return board_.map(); }
  MeshChanges take_mesh_changes() override { return board_.take_mesh_changes(); }
  std::vector<StageStatistics> stage_times() const override { return first_.stage_times(); }

  void set_paused(bool paused) override {
    for (LiveSlam* sensor : {&first_, &second_}) sensor->set_paused(paused);
  }
  void undo_last_trial() override {
    const std::lock_guard lock(mutex_);
    (view_.shows_second() ? second_ : first_).undo_last_trial();
  }
  void save_now() override {
    for (LiveSlam* sensor : {&first_, &second_}) sensor->save_now();
  }
  void stop() override {
    for (LiveSlam* sensor : {&first_, &second_}) sensor->stop();
  }
  void abort() override {
    aborted_ = true;
    for (LiveSlam* sensor : {&first_, &second_}) sensor->abort();
  }
  RunReport wait() override;
  std::vector<BackgroundFrames> background_frames() const override {
    return {first_.background_frames().front(), second_.background_frames().front()};
  }

 private:
  void look();
  void run();
  void fuse();
  void join();

  const LiveRigOptions options_;
  const std::optional<RigPose> known_ = read_given_rig(options_.rig);  // before the sensors start
  const bool show_mesh_;
  StageTimer timer_;
  LiveBoard board_{""};  // of the one map
  FusionStage fusion_;
  LiveSlam first_, second_;
  std::atomic<bool> aborted_{false}, joining_{false};

  mutable std::mutex mutex_;  // for what follows
  RigView view_;
  RunReport report_;
  std::exception_ptr failure_;
  std::string failure_in_words_;
  std::jthread fusion_thread_, thread_;
};

LiveStatus LiveRig::status() const {
  const std::array<LiveStatus, 2> sensors = {first_.status(), second_.status()};
  const std::lock_guard lock(mutex_);
  LiveStatus status = board_.status();
  const LiveStatus& shown = sensors[view_.shows_second() ? 1 : 0];
  if (!joining_) {
    status.phase = phase_of_both(sensors[0].phase, sensors[1].phase);
    status.track = shown.track;
    status.words = status.phase == LivePhase::scanning ? shown.words
                   : sensors[0].phase == status.phase  ? sensors[0].words
                                                       : sensors[1].words;
  }
  status.rate_hz = shown.rate_hz;
  for (const std::size_t sensor : {0, 1}) add_sensor(status, sensors[sensor], sensor);
  append_sentence(status.failure, failure_in_words_);
  const bool saved = status.phase == LivePhase::finished && !failure_;
  status.run_folder = saved ? options_.run_folder.string() : sensors[0].run_folder;
  status.drift_mm = report_.uncertainty.drift_mm.amount;
  status.drift_deg = report_.uncertainty.drift_deg.amount;
  status.reservations = report_.reservations;
  return status;
}

void LiveRig::look() {
  const RigNews news{{first_.touch(), second_.touch()}, {first_.map(), second_.map()}};
  view_.learn(news);
  const std::lock_guard lock(mutex_);
  view_.show(news);
  if (board_.map() == view_.map()) return;
  board_.set_map(view_.map());
  if (show_mesh_) fusion_.set_map(view_.map());
}

void LiveRig::fuse() {
  lower_thread_priority();
  try {
    fusion_.run();
  } catch (const std::exception& error) {  // whatever it is, the scan goes on
    board_.warn(error.what());
  }
}

void LiveRig::run() {
  const auto has_ended = [](const LiveSlam& sensor) { return sensor.status().phase == LivePhase::finished; };
  while (!has_ended(first_) || !has_ended(second_)) {
    look();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  board_.set_phase(LivePhase::finishing);
  joining_ = true;
  try {
    join();
  } catch (const std::exception& error) {
    board_.warn(error.what());
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    failure_in_words_ = error.what();
  }
  fusion_.stop();
  board_.set_phase(LivePhase::finished);
}

void LiveRig::join() {
  MergeRequest request;
  if (options_.continued) request.runs.push_back(options_.run_folder);
  bool partial = false;
  for (const std::size_t i : {0, 1}) {
    LiveSlam& sensor = i == 0 ? first_ : second_;
    try {
      partial = sensor.wait().partial || partial;
    } catch (const Error& error) {
      throw Error(of_sensor(i, error.what()));
    }
    request.runs.emplace_back(sensor.status().run_folder);
  }
  request.run_folder = options_.run_folder;
  request.in_place = options_.continued;
  request.overwrite = options_.overwrite;
  request.has_rig = true;
  request.rig = known_;
  BoardProgress progress(board_);
  const Run run = merge_scans(request, progress, [this] { return aborted_.load(); });
  fusion_.stop();
  fusion_thread_.join();  // what it drew must not come after what is saved
  board_.show_saved(run.map, run.mesh);
  const std::lock_guard lock(mutex_);
  report_ = run.report;
  report_.partial = report_.partial || partial;
  report_.seconds = board_.status().age_s;
  board_.set_words("done: saved in " + options_.run_folder.string(), TrackStatus::background);
}

RunReport LiveRig::wait() {
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  return report_;
}

}  // namespace

std::filesystem::path run_of_sensor(const std::filesystem::path& run_folder, int sensor, int sensors) {
  if (sensors == 1) return run_folder;
  std::filesystem::path folder = run_folder.has_filename() ? run_folder : run_folder.parent_path();
  folder += sensor == 0 ? "-first" : "-second";
  return folder;
}

std::unique_ptr<LiveSession> begin_live(RawFrameSources sources, const std::vector<LiveOptions>& options,
                                        const LiveRigOptions& rig) {
  if (sources.size() == 1) return std::make_unique<LiveSlam>(std::move(sources.front()), options.front());
  return std::make_unique<LiveRig>(std::move(sources), options, rig);
}

}  // namespace gelslam
