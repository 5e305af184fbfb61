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

}  // namespace

struct LiveRig::Impl {
  Impl(std::array<Sensor, 2> of, const LiveRigOptions& rig_options)
      : options(rig_options),
        show_mesh(of[0].options.show_mesh),
        fusion(of[0].options.config.slam.fusion, board, timer),
        first(std::move(of[0].source), without_mesh(of[0].options)),
        second(std::move(of[1].source), without_mesh(of[1].options)),
        view(known) {
    fusion_thread = std::jthread([this] {
      lower_thread_priority();
      try {
        fusion.run();
      } catch (const std::exception& error) {  // whatever it is, the scan goes on
        board.warn(error.what());
      }
    });
    thread = std::jthread([this] { run(); });
  }

  void look();
  void run();
  void end_of(LiveSlam& session, std::size_t sensor);
  void join();

  const LiveRigOptions options;
  const std::optional<RigPose> known = read_given_rig(options.rig);  // before the sensors start
  const bool show_mesh;
  StageTimer timer;
  LiveBoard board{""};  // of the one map
  FusionStage fusion;
  LiveSlam first, second;
  std::atomic<bool> aborted{false}, joining{false};

  mutable std::mutex mutex;  // for what follows
  RigView view;
  RunReport report;
  std::exception_ptr failure;
  std::string failure_in_words;
  std::jthread fusion_thread, thread;
};

void LiveRig::Impl::look() {
  const RigNews news{{first.touch(), second.touch()}, {first.map(), second.map()}};
  view.learn(news);
  const std::lock_guard lock(mutex);
  view.show(news);
  if (board.map() == view.map()) return;
  board.set_map(view.map());
  if (show_mesh) fusion.set_map(view.map());
}

void LiveRig::Impl::run() {
  const auto has_ended = [](const LiveSlam& session) {
    return session.status().phase == LivePhase::finished;
  };
  while (!has_ended(first) || !has_ended(second)) {
    look();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  board.set_phase(LivePhase::finishing);
  joining = true;
  try {
    end_of(first, 0);
    end_of(second, 1);
    join();
  } catch (const std::exception& error) {
    board.warn(error.what());
    const std::lock_guard lock(mutex);
    failure = std::current_exception();
    failure_in_words = error.what();
  }
  fusion.stop();
  board.set_phase(LivePhase::finished);
}

void LiveRig::Impl::end_of(LiveSlam& session, std::size_t sensor) {
  try {
    session.wait();
  } catch (const Error& error) {
    throw Error(of_sensor(sensor, error.what()));
  }
}

void LiveRig::Impl::join() {
  MergeRequest request;
  if (options.continued) request.runs.push_back(options.run_folder);
  for (const LiveSlam* session : {&first, &second}) request.runs.emplace_back(session->status().run_folder);
  request.run_folder = options.run_folder;
  request.in_place = options.continued;
  request.overwrite = options.overwrite;
  request.has_rig = true;
  request.rig = known;
  BoardProgress progress(board);
  const Run run = merge_scans(request, progress, [this] { return aborted.load(); });
  fusion.stop();
  fusion_thread.join();  // what it drew must not come after what is saved
  board.show_saved(run.map, run.mesh);
  const std::lock_guard lock(mutex);
  report = run.report;
  report.partial = report.partial || first.wait().partial || second.wait().partial;
  report.seconds = board.status().age_s;
  board.set_words("done: saved in " + options.run_folder.string(), TrackStatus::background);
}

std::filesystem::path run_of_sensor(const std::filesystem::path& run_folder, int sensor) {
  std::filesystem::path folder = run_folder.has_filename() ? run_folder : run_folder.parent_path();
  folder += sensor == 0 ? "-first" : "-second";
  return folder;
}

LiveRig::LiveRig(std::array<Sensor, 2> sensors, const LiveRigOptions& options)
    : impl_(std::make_unique<Impl>(std::move(sensors), options)) {}

LiveRig::~LiveRig() {
  abort();
  if (impl_->thread.joinable()) impl_->thread.join();
}

LiveStatus LiveRig::status() const {
  const std::array<LiveStatus, 2> sensors = {impl_->first.status(), impl_->second.status()};
  const std::lock_guard lock(impl_->mutex);
  LiveStatus status = impl_->board.status();
  const LiveStatus& shown = sensors[impl_->view.shows_second() ? 1 : 0];
  if (!impl_->joining) {
    status.phase = phase_of_both(sensors[0].phase, sensors[1].phase);
    status.track = shown.track;
    status.words = status.phase == LivePhase::scanning ? shown.words
                   : sensors[0].phase == status.phase  ? sensors[0].words
                                                       : sensors[1].words;
  }
  status.rate_hz = shown.rate_hz;
  for (const std::size_t sensor : {0, 1}) add_sensor(status, sensors[sensor], sensor);
  append_sentence(status.failure, impl_->failure_in_words);
  const bool saved = status.phase == LivePhase::finished && !impl_->failure;
  status.run_folder = saved ? impl_->options.run_folder.string() : sensors[0].run_folder;
  status.drift_mm = impl_->report.uncertainty.drift_mm.amount;
  status.drift_deg = impl_->report.uncertainty.drift_deg.amount;
  status.reservations = impl_->report.reservations;
  return status;
}

std::shared_ptr<const LiveTouch> LiveRig::touch() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->view.touch();
}

std::vector<std::shared_ptr<const LiveTouch>> LiveRig::touches() const {
  return {impl_->first.touch(), impl_->second.touch()};
}

std::shared_ptr<const MapSnapshot> LiveRig::map() const { return impl_->board.map(); }
MeshChanges LiveRig::take_mesh_changes() { return impl_->board.take_mesh_changes(); }
std::vector<StageStatistics> LiveRig::stage_times() const { return impl_->first.stage_times(); }

void LiveRig::set_paused(bool paused) {
  impl_->first.set_paused(paused);
  impl_->second.set_paused(paused);
}

void LiveRig::undo_last_trial() {
  const std::lock_guard lock(impl_->mutex);
  (impl_->view.shows_second() ? impl_->second : impl_->first).undo_last_trial();
}

void LiveRig::save_now() {
  impl_->first.save_now();
  impl_->second.save_now();
}

void LiveRig::stop() {
  impl_->first.stop();
  impl_->second.stop();
}

void LiveRig::abort() {
  impl_->aborted = true;
  impl_->first.abort();
  impl_->second.abort();
}

RunReport LiveRig::wait() {
  if (impl_->thread.joinable()) impl_->thread.join();
  const std::lock_guard lock(impl_->mutex);
  if (impl_->failure) std::rethrow_exception(impl_->failure);
  return impl_->report;
}

BackgroundFrames LiveRig::background_frames(int sensor) const {
  return (sensor == 0 ? impl_->first : impl_->second).background_frames();
}

}  // namespace gelslam
