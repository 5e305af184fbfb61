#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/angles.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/map_folder.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "gelslam/slam/trial_places.hpp"
#include "gelslam/slam/tum.hpp"

namespace gelslam {
namespace {

struct TrackArguments {
  LogOptions log;
  std::optional<std::string> camera;
  std::string map, format = "tum";
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
      return sigma ? reservations(frame, *sigma) : "";
    case TrackStatus::lost:
      return std::string(describe(frame.registration.status));
  }
  return "";
}

nlohmann::ordered_json three_numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void add_sigma(nlohmann::ordered_json& json, const std::optional<Vector6d>& sigma) {
  json["sigma_mm"] = sigma ? three_numbers(sigma->head<3>()) : nlohmann::ordered_json(nullptr);
  json["sigma_deg"] =
      sigma ? three_numbers(kDegreesPerRadian * sigma->tail<3>()) : nlohmann::ordered_json(nullptr);
}

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
  add_sigma(json, sigma);
  json["scr"] = frame.registration.scr;
  json["ccs"] = frame.registration.ccs;
  return json;
}

std::string_view map_status(const LocalizedFrame& frame) {
  if (frame.tracked.status == TrackStatus::background || frame.tracked.status == TrackStatus::no_contact)
    return name(frame.tracked.status);
  switch (frame.status) {
    case PlaceStatus::localized:
      return "localized";
    case PlaceStatus::ambiguous:
      return "ambiguous";
    case PlaceStatus::unknown:
      return "not in the map";
  }
  return "";
}

/// One standard deviation: x y z in mm, rx ry rz in rad.
Vector6d sigma_of(const Matrix6d& covariance) {
  const Vector6d sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return (Vector6d() << sigma.tail<3>(), sigma.head<3>()).finished();
}

nlohmann::ordered_json ndjson(const PlaceHypothesis& hypothesis) {
  nlohmann::ordered_json json;
  json["probability"] = hypothesis.probability;
  json["pose"] = row_major_metres(hypothesis.map_T_sensor);
  add_sigma(json, sigma_of(hypothesis.covariance));
  return json;
}

nlohmann::ordered_json map_ndjson(const LocalizedFrame& frame) {
  const bool localized = frame.status == PlaceStatus::localized;
  std::optional<Vector6d> sigma;
  if (localized) sigma = sigma_of(frame.hypotheses.front().covariance);
  nlohmann::ordered_json json = ndjson(frame.tracked, sigma);
  const bool is_touch = frame.tracked.status != TrackStatus::background;
  json["status"] = map_status(frame);
  if (is_touch) json["reason"] = frame.reason;
  json["pose"] = localized ? nlohmann::ordered_json(row_major_metres(frame.hypotheses.front().map_T_sensor))
                           : nlohmann::ordered_json(nullptr);
  json["in_map"] = localized;
  json["hypotheses"] = nlohmann::ordered_json::array();
  for (const PlaceHypothesis& hypothesis : frame.hypotheses) json["hypotheses"].push_back(ndjson(hypothesis));
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

/// Where the poses go: frame by frame to stdout.
class PoseOutput {
 public:
  virtual ~PoseOutput() = default;
  /// True when the frame has a pose.
  virtual bool write(const SurfaceStream::Item& item) = 0;
};

/// Poses in the frame of the trial, or, as TUM, of the first contact.
class TrialOutput final : public PoseOutput {
 public:
  TrialOutput(const SlamOptions& options, bool as_ndjson)
      : as_ndjson_(as_ndjson),
        tracker_(options.tracker, options.registration, options.verification),
        tum_(options),
        drift_(options.slope_calibration.gradient_scale_sigma) {}

  bool write(const SurfaceStream::Item& item) override {
    const TrackedFrame frame =
        item.surface ? tracker_.track(item.frame, item.time_s, item.surface) : background_frame(item);
    if (as_ndjson_)
      std::cout << ndjson(frame, drift_.add(frame)).dump() << std::endl;
    else
      tum_.write(frame);
    return frame.status == TrackStatus::tracked;
  }

 private:
  bool as_ndjson_;
  Tracker tracker_;
  TumStream tum_;
  TrialDrift drift_;
};

/// Poses in the frame of a map.
class MapOutput final : public PoseOutput {
 public:
  MapOutput(const std::filesystem::path& map, const SlamOptions& options, bool as_ndjson)
      : as_ndjson_(as_ndjson),
        localizer_(std::make_shared<const SurfaceMap>(read_map(map), options), options) {}

  bool write(const SurfaceStream::Item& item) override {
    LocalizedFrame frame;
    if (item.surface)
      frame = localizer_.process(item.frame, item.time_s, item.surface);
    else
      frame.tracked = background_frame(item);
    const bool localized = frame.status == PlaceStatus::localized;
    if (as_ndjson_)
      std::cout << map_ndjson(frame).dump() << std::endl;
    else if (localized)
      std::cout << tum_line(item.time_s, frame.hypotheses.front().map_T_sensor) << std::flush;
    return localized;
  }

 private:
  bool as_ndjson_;
  Localizer localizer_;
};

std::unique_ptr<PoseOutput> make_output(const TrackArguments& arguments, const SlamOptions& options) {
  const bool as_ndjson = arguments.format == "ndjson";
  if (arguments.map.empty()) return std::make_unique<TrialOutput>(options, as_ndjson);
  return std::make_unique<MapOutput>(arguments.map, options, as_ndjson);
}

/// All frames of the stream to the output, until `stopped`. True when any had a pose.
bool write_poses(SurfaceStream& stream, PoseOutput& output, const InterruptStopper& interrupt) {
  for (const std::string& doubt : stream.background_doubts())
    std::cerr << "gelslam: warning: " << doubt << "\n";
  bool any = false;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    any = output.write(*item) || any;
    if (interrupt.requested() || !std::cout) break;
  }
  if (!stream.warning().empty()) std::cerr << "gelslam: warning: " << stream.warning() << "\n";
  return any;
}

int run(const TrackArguments& arguments) {
  if (arguments.camera && !arguments.log.log.empty()) throw Error("give either LOG or --camera, not both");
  if (!arguments.camera && arguments.log.log.empty()) throw Error("give a LOG, or --camera");
  const LogInput input = arguments.log.input();
  const Config config = resolve_config(input);
  const std::unique_ptr<PoseOutput> output = make_output(arguments, config.slam);
  StageTimer timer;
  if (!arguments.camera) {
    SurfaceStream stream(input, config, timer);
    const InterruptStopper interrupt([] {});
    return write_poses(stream, *output, interrupt) ? exit_done : exit_not_good;
  }
  CameraInput camera = open_camera_input(config, *arguments.camera);
  RawFrameSource& frames = *camera.frames;
  const InterruptStopper interrupt([&frames] { frames.stop(); });
  SurfaceStream stream(decode_frames(std::move(camera.frames), "camera", config.sensor), input, config, timer,
                       [](const std::string& request) { std::cerr << "gelslam: " << request << "\n"; });
  return write_poses(stream, *output, interrupt) ? exit_done : exit_not_good;
}

}  // namespace

void add_track_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<TrackArguments>();
  CLI::App* command =
      app.add_subcommand("track", "Stream the sensor's pose against the object, frame by frame, to stdout");
  arguments->log.add_to(*command);
  command->get_option("LOG")->required(false);
  command
      ->add_option("--camera,--device", arguments->camera,
                   "A camera instead of LOG: a path, a number or part of its name (default: the "
                   "configuration's)")
      ->expected(0, 1);
  command->add_option("--map", arguments->map,
                      "Poses in this map: a run folder, its session, or a folder made by gelslam map");
  command
      ->add_option(
          "--format", arguments->format,
          "tum: time and pose (meters, in the frame of the first contact, or of the map) of every frame that "
          "has a pose; after a loss, poses continue once a place is recognized. ndjson: one object per frame")
      ->check(CLI::IsMember({"tum", "ndjson"}))
      ->capture_default_str();
  command->footer(
      "Examples:\n  gelslam track data/pebble --format ndjson\n"
      "  gelslam track --camera --map runs/pebble --format ndjson");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
