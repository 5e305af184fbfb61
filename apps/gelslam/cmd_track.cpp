#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/angles.hpp"
#include "gelslam/core/interrupt.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "gelslam/slam/trial_places.hpp"
#include "gelslam/slam/tum.hpp"

namespace gelslam {
namespace {

struct TrackArguments {
  LogOptions log;
  std::string format = "tum";
};

std::array<double, 16> row_major_metres(const Pose& pose_mm) {
  std::array<double, 16> numbers{};
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      numbers[static_cast<std::size_t>(r * 4 + c)] = pose_mm.matrix()(r, c) * (r < 3 && c == 3 ? 1e-3 : 1.0);
  return numbers;
}

/// What is uncertain about a tracked frame: the degenerate directions, and how far the trial may have
/// drifted.
std::string reservations(const TrackedFrame& frame, const Vector6d& sigma) {
  const std::array<bool, 6>& observable = frame.registration.observable;
  Vector6d of_shown = sigma;
  for (std::size_t axis = 0; axis < observable.size(); ++axis)
    if (!observable[axis]) of_shown[static_cast<int>(axis)] = 0.0;  // said already
  const std::string hidden = describe_observability(observable), drift = describe_drift(of_shown);
  return hidden + (hidden.empty() || drift.empty() ? "" : "; ") + drift;
}

std::string reason(const TrackedFrame& frame, const std::optional<Vector6d>& sigma) {
  switch (frame.status) {
    case TrackStatus::background:
      return "the bare gel; contact is detected by comparing with it";
    case TrackStatus::no_contact:
      return "nothing touches the sensor";
    case TrackStatus::undone:
      return "taken back";
    case TrackStatus::tracked:
      return reservations(frame, *sigma);
    case TrackStatus::lost:
      return std::string(describe(frame.registration.status));
  }
  return "";
}

nlohmann::ordered_json three_numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// `sigma`: of the pose, as TrialDrift says.
nlohmann::ordered_json ndjson(const TrackedFrame& frame, const std::optional<Vector6d>& sigma) {
  nlohmann::ordered_json json;
  json["frame"] = frame.frame;
  json["time_s"] = frame.time_s;
  json["status"] = name(frame.status);
  json["reason"] = reason(frame, sigma);
  const bool tracked = frame.status == TrackStatus::tracked;
  json["trial"] = tracked ? nlohmann::ordered_json(frame.trial) : nlohmann::ordered_json(nullptr);
  json["pose"] = tracked ? nlohmann::ordered_json(row_major_metres(frame.trial_T_frame))
                         : nlohmann::ordered_json(nullptr);
  json["observable"] = nlohmann::ordered_json::array();
  for (const bool axis : frame.registration.observable) json["observable"].push_back(tracked && axis ? 1 : 0);
  json["sigma_mm"] = sigma ? three_numbers(sigma->head<3>()) : nlohmann::ordered_json(nullptr);
  json["sigma_deg"] =
      sigma ? three_numbers(kDegreesPerRadian * sigma->tail<3>()) : nlohmann::ordered_json(nullptr);
  json["scr"] = frame.registration.scr;
  json["ccs"] = frame.registration.ccs;
  return json;
}

TrackedFrame background_frame(const SurfaceStream::Item& item) {
  TrackedFrame frame;
  frame.frame = item.frame;
  frame.time_s = item.time_s;
  frame.status = TrackStatus::background;
  return frame;
}

/// TUM has one frame for all poses: that of the first contact. Frames of a later trial are in it once a loop
/// has told where that trial lies.
class TumStream {
 public:
  explicit TumStream(const SlamOptions& options) : places_(options) {}

  void write(const TrackedFrame& frame) {
    for (const NewKeyframe& added : frame.new_keyframes) places_.add(added);
    if (frame.status != TrackStatus::tracked) return;
    if (const std::optional<Pose> first_T_trial = places_.first_T_trial(frame.trial))
      std::cout << tum_line(frame.time_s, *first_T_trial * frame.trial_T_frame) << std::flush;
  }

 private:
  TrialPlaces places_;
};

int run(const TrackArguments& arguments) {
  const LogInput input = arguments.log.input();
  const Config config = resolve_config(input);
  StageTimer timer;
  SurfaceStream stream(input, config, timer);
  for (const std::string& doubt : stream.background_doubts())
    std::cerr << "gelslam: warning: " << doubt << "\n";
  Tracker tracker(config.slam.tracker, config.slam.registration, config.slam.verification);
  TumStream tum(config.slam);
  TrialDrift drift(config.slam.slope_calibration.gradient_scale_sigma);
  const InterruptWatch interrupt;
  bool ever_tracked = false;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    const TrackedFrame frame =
        item->surface ? tracker.track(item->frame, item->time_s, item->surface) : background_frame(*item);
    const bool tracked = frame.status == TrackStatus::tracked;
    ever_tracked = ever_tracked || tracked;
    if (arguments.format == "ndjson")
      std::cout << ndjson(frame, drift.add(frame)).dump() << std::endl;
    else
      tum.write(frame);
    if (interrupt.requested() || !std::cout) break;
  }
  if (!stream.warning().empty()) std::cerr << "gelslam: warning: " << stream.warning() << "\n";
  return ever_tracked ? exit_done : exit_not_good;
}

}  // namespace

void add_track_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<TrackArguments>();
  CLI::App* command =
      app.add_subcommand("track", "Stream the sensor's pose against the object, frame by frame, to stdout");
  arguments->log.add_to(*command);
  command
      ->add_option(
          "--format", arguments->format,
          "tum: time and pose (meters, in the frame of the first contact) of every frame that has a pose; "
          "after a loss, poses continue once a place is recognized. ndjson: one object per frame")
      ->check(CLI::IsMember({"tum", "ndjson"}))
      ->capture_default_str();
  command->footer("Example: gelslam track data/pebble --format ndjson");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
