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
#include "gelslam/core/text.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "live/live_board.hpp"
#include "live/rig_view.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

constexpr std::array<const char*, 2> kNames = {"first sensor", "second sensor"};

std::string of_both(const std::string& first, const std::string& second) {
  std::string text;
  if (!first.empty()) append_sentence(text, std::string(kNames[0]) + ": " + first);
  if (!second.empty()) append_sentence(text, std::string(kNames[1]) + ": " + second);
  return text;
}

/// A sensor that has ended does not hold up the other one.
LivePhase phase_of_both(LivePhase first, LivePhase second) {
  const LivePhase phase = std::min(first, second);
  return phase == LivePhase::finished ? LivePhase::finishing : phase;
}

/// `second_speaks`: the state is that of the second sensor.
LiveStatus status_of_both(const LiveStatus& first, const LiveStatus& second, bool second_speaks) {
  LiveStatus both = second_speaks ? second : first;
  both.phase = phase_of_both(first.phase, second.phase);
  if (both.phase != LivePhase::scanning) both.words = first.phase == both.phase ? first.words : second.words;
  both.warnings.clear();
  for (const std::string& warning : first.warnings) both.warnings.push_back(of_both(warning, ""));
  for (const std::string& warning : second.warnings) both.warnings.push_back(of_both("", warning));
  both.saving = first.saving || second.saving;
  both.failure = of_both(first.failure, second.failure);
  both.source = first.source + "; " + second.source;
  both.run_folder = first.run_folder;
  both.frames = first.frames + second.frames;
  both.lost_by_camera = first.lost_by_camera + second.lost_by_camera;
  both.dropped = first.dropped + second.dropped;
  both.damaged = first.damaged + second.damaged;
  both.latency_ms = std::max(first.latency_ms, second.latency_ms);
  both.keyframes = first.keyframes + second.keyframes;
  both.loops = first.loops + second.loops;
  both.trials = first.trials + second.trials;
  both.log_bytes = first.log_bytes + second.log_bytes;
  both.drift_mm = both.drift_deg = 0;  // of one map: known at the end
  both.reservations.clear();
  return both;
}

}  // namespace

struct LiveRig::Impl {
  Impl(std::array<Sensor, 2> sensors, const LiveRigOptions& rig_options)
      : options(rig_options),
        first(std::move(sensors[0].source), sensors[0].options),
        second(std::move(sensors[1].source), sensors[1].options),
        view(known) {
    thread = std::jthread([this] { run(); });
  }

  void look();
  void run();
  void end_of(LiveSlam& session, int sensor);
  void join();

  const LiveRigOptions options;
  const std::optional<RigPose> known = read_given_rig(options.rig);  // before the sensors start
  LiveSlam first, second;
  LiveBoard board{""};  // from when both have ended
  std::atomic<bool> aborted{false};

  mutable std::mutex mutex;  // for what follows
  RigView view;
  bool joining = false;
  LiveStatus last;  // of both, when they ended
  RunReport report;
  std::exception_ptr failure;
  std::string failure_in_words;
  std::jthread thread;
};

void LiveRig::Impl::look() {
  const RigNews news{{first.touch(), second.touch()}, {first.map(), second.map()}};
  view.learn(news);
  const std::lock_guard lock(mutex);
  view.show(news);
}

void LiveRig::Impl::run() {
  const auto has_ended = [](const LiveSlam& session) {
    return session.status().phase == LivePhase::finished;
  };
  while (!has_ended(first) || !has_ended(second)) {
    look();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  {
    const std::lock_guard lock(mutex);
    last = status_of_both(first.status(), second.status(), false);
    joining = true;
  }
  board.set_phase(LivePhase::finishing);
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
  board.set_phase(LivePhase::finished);
}

void LiveRig::Impl::end_of(LiveSlam& session, int sensor) {
  try {
    session.wait();
  } catch (const Error& error) {
    throw Error(std::string(kNames[static_cast<std::size_t>(sensor)]) + ": " + error.what());
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
  board.show_saved(run.map, run.mesh);
  const std::lock_guard lock(mutex);
  report = run.report;
  report.partial = report.partial || first.wait().partial || second.wait().partial;
  report.seconds = last.age_s + board.status().age_s;
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
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->joining) {
    LiveStatus status =
        status_of_both(impl_->first.status(), impl_->second.status(), impl_->view.shows_second());
    status.components = impl_->view.components();
    return status;
  }
  LiveStatus status = impl_->last;
  const LiveStatus of_join = impl_->board.status();
  status.phase = of_join.phase;
  status.words = of_join.words;
  status.progress = of_join.progress;
  status.warnings.insert(status.warnings.end(), of_join.warnings.begin(), of_join.warnings.end());
  append_sentence(status.failure, impl_->failure_in_words);
  if (status.phase != LivePhase::finished || impl_->failure) return status;
  const RunReport& report = impl_->report;
  status.run_folder = impl_->options.run_folder.string();
  status.keyframes = report.keyframes;
  status.loops = report.loops;
  status.trials = report.trials;
  status.components = report.components;
  status.drift_mm = report.uncertainty.drift_mm.amount;
  status.drift_deg = report.uncertainty.drift_deg.amount;
  status.reservations = report.reservations;
  return status;
}

std::shared_ptr<const LiveTouch> LiveRig::touch() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->view.touch();
}

std::vector<std::shared_ptr<const LiveTouch>> LiveRig::touches() const {
  return {impl_->first.touch(), impl_->second.touch()};
}

std::shared_ptr<const MapSnapshot> LiveRig::map() const {
  const std::lock_guard lock(impl_->mutex);
  const std::shared_ptr<const MapSnapshot> joined = impl_->board.map();
  return joined->nodes.empty() ? impl_->view.map() : joined;
}

MeshChanges LiveRig::take_mesh_changes() {
  const std::lock_guard lock(impl_->mutex);
  MeshChanges joined = impl_->board.take_mesh_changes();
  if (impl_->joining) return joined;
  return impl_->view.take_mesh_changes({impl_->first.take_mesh_changes(), impl_->second.take_mesh_changes()});
}

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
