#include <unistd.h>

#include <atomic>
#include <functional>
#include <future>
#include <iostream>
#include <limits>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/localization/rig_place.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/pose_stream.hpp"
#include "gelslam/slam/sensor_rig.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "gelslam/slam/trial_places.hpp"
#include "stream_arguments.hpp"
#include "terminal_progress.hpp"
#include "track_window.hpp"

namespace gelslam {
namespace {

struct TrackArguments {
  std::vector<std::string> logs;     ///< or
  std::vector<std::string> cameras;  ///< "": the configuration's
  LogOptions settings;
  std::string map, rig, opening;
  StreamArguments stream{.target = "-", .format = "tum"};
  MapWindowArguments window;
  bool quiet = false;
};

using Json = nlohmann::ordered_json;

Json hypothesis_json(const PlaceHypothesis& hypothesis) {
  Json json = {{"probability", hypothesis.probability}, {"pose", row_major_meters(hypothesis.map_T_sensor)}};
  add_sigma(json, translation_first(hypothesis.covariance));
  return json;
}

/// As frame_json(), with what localization knows.
Json map_json(const LocalizedFrame& frame, const Surface* surface) {
  const bool localized = frame.status == PlaceStatus::localized;
  FrameReport report{frame.tracked, surface};
  if (localized) report.covariance = translation_first(frame.hypotheses.front().covariance);
  Json json = frame_json(report);
  json["status"] = status_name(frame);
  if (frame.tracked.status != TrackStatus::background) json["reason"] = frame.reason;
  json["pose"] = localized ? Json(row_major_meters(frame.hypotheses.front().map_T_sensor)) : Json(nullptr);
  json["in_map"] = localized;
  json["hypotheses"] = Json::array();
  for (const PlaceHypothesis& hypothesis : frame.hypotheses)
    json["hypotheses"].push_back(hypothesis_json(hypothesis));
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

  /// "" for a frame that has no pose.
  std::string line(const TrackedFrame& frame) {
    for (const NewKeyframe& added : frame.new_keyframes) places_.add(added.keyframe);
    if (frame.status != TrackStatus::tracked) return "";
    const std::optional<Pose> first_T_trial = places_.first_T_trial(frame.trial);
    return first_T_trial ? tum_line(frame.time_s, *first_T_trial * frame.trial_T_frame) : "";
  }

 private:
  TrialPlaces places_;
};

/// A line of the stream, "" for none, and whether the frame has a pose.
struct PoseLine {
  std::string text;
  bool has_pose = false;
};

class PoseOutput {
 public:
  virtual ~PoseOutput() = default;
  virtual PoseLine line(const SurfaceStream::Item& item) = 0;
  /// What was not right with the poses, or "". At the end.
  virtual std::string warning() const { return ""; }
};

/// Poses in the frame of the trial, or, as TUM, of the first contact.
class TrialOutput final : public PoseOutput {
 public:
  TrialOutput(const SlamOptions& options, bool as_ndjson)
      : as_ndjson_(as_ndjson),
        tracker_(options.tracker, options.registration, options.verification),
        tum_(options),
        drift_(options.slope_calibration.gradient_scale_sigma) {}

  PoseLine line(const SurfaceStream::Item& item) override {
    const TrackedFrame frame =
        item.surface ? tracker_.track(item.frame, item.time_s, item.surface) : background_frame(item);
    const bool tracked = frame.status == TrackStatus::tracked;
    if (!as_ndjson_) return {tum_.line(frame), tracked};
    FrameReport report{frame, item.surface.get()};
    report.covariance = drift_.add(frame);
    return {ndjson_line(report), tracked};
  }

 private:
  bool as_ndjson_;
  Tracker tracker_;
  TumStream tum_;
  TrialDrift drift_;
};

/// A sensor, and how its frames become surfaces.
struct TrackedSensor {
  LogInput input;
  Config config;
  bool is_camera = false;
  std::shared_ptr<RawFrameSource> frames;  ///< null: the log, as fast as it can be read
};

SurfaceStream open_stream(const TrackedSensor& sensor, StageTimer& timer) {
  if (!sensor.frames) return {sensor.input, sensor.config, timer};
  std::function<void(const std::string&)> ask;
  if (sensor.is_camera) ask = [](const std::string& request) { std::cerr << "gelslam: " << request << "\n"; };
  const std::string name = sensor.is_camera ? "camera" : sensor.input.log.string();
  return {decode_frames(sensor.frames, name, sensor.config.sensor), sensor.input, sensor.config, timer, ask};
}

LocalizedFrame localized(Localizer& localizer, const SurfaceStream::Item& item) {
  if (item.surface) return localizer.process(item.frame, item.time_s, item.surface);
  LocalizedFrame frame;
  frame.tracked = background_frame(item);
  return frame;
}

void warn(const std::string& warning) {
  if (!warning.empty()) std::cerr << "warning: " << warning << "\n";
}

/// The second of two sensors that are fixed to each other.
class SecondSensor {
 public:
  SecondSensor(const TrackedSensor& sensor, std::shared_ptr<const SurfaceMap> map, StageTimer& timer)
      : stream_(open_stream(sensor, timer)), localizer_(std::move(map), sensor.config.slam) {
    for (const std::string& doubt : stream_.background_doubts()) warn("second sensor: " + doubt);
    newest_.place.tracked.time_s = -std::numeric_limits<double>::infinity();
  }

  /// Its place in the map, if it knows that. Waits for its first frame at this time or later.
  std::optional<PlaceHypothesis> at(double time_s) {
    while (!has_ended_ && newest_.place.tracked.time_s < time_s) {
      const std::optional<SurfaceStream::Item> item = next();
      has_ended_ = !item;
      if (!item) break;
      before_ = std::move(newest_.place);
      newest_ = {item->picture, item->surface, localized(localizer_, *item)};
    }
    return has_ended_ ? std::nullopt : place_between(before_, newest_.place, time_s);
  }
  const LocatedTouch& newest() const { return newest_; }
  std::string warning() const { return stream_.warning(); }

 private:
  /// The first sensor goes on when this one is lost.
  std::optional<SurfaceStream::Item> next() {
    try {
      return stream_.next();
    } catch (const Error& error) {
      warn("second sensor: " + std::string(error.what()));
      return std::nullopt;
    }
  }

  SurfaceStream stream_;
  Localizer localizer_;
  LocalizedFrame before_;
  LocatedTouch newest_;
  bool has_ended_ = false;
};

/// Poses in the frame of a map, and what `touches` (or null) shows of them. Of two sensors (`second` is not
/// null), poses of the first one that both know.
class MapOutput final : public PoseOutput {
 public:
  MapOutput(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options, bool as_ndjson,
            LocatedTouches* touches, SecondSensor* second, GivenRig rig)
      : as_ndjson_(as_ndjson),
        localizer_(std::move(map), options),
        touches_(touches),
        second_(second),
        rig_(std::move(rig)) {}

  PoseLine line(const SurfaceStream::Item& item) override {
    std::future<std::optional<PlaceHypothesis>> of_second;
    if (second_) of_second = std::async(std::launch::async, [&] { return second_->at(item.time_s); });
    LocalizedFrame frame = localized(localizer_, item);
    std::vector<int> sensors;
    if (second_) {
      const std::optional<PlaceHypothesis> other = of_second.get();
      const bool both = other && frame.status == PlaceStatus::localized;
      sensors = share_place(frame, other, rig_.pose_at(item.time_s));
      if (both) ++(sensors.size() == 2 ? agreed_ : contradicted_);
    }
    if (touches_ != nullptr) {
      const auto touch = std::make_shared<LocatedTouch>(LocatedTouch{item.picture, item.surface, frame});
      if (second_) touch->second = std::make_shared<const LocatedTouch>(second_->newest());
      touches_->newest = touch;
      if (!frame.hypotheses.empty()) touches_->placed = touch;
    }
    const bool localized = frame.status == PlaceStatus::localized;
    if (!as_ndjson_)
      return {localized ? tum_line(item.time_s, frame.hypotheses.front().map_T_sensor) : "", localized};
    Json json = map_json(frame, item.surface.get());
    if (second_) json["sensors"] = sensors;
    return {json.dump() + "\n", localized};
  }

  std::string warning() const override {
    if (10 * contradicted_ <= agreed_ + contradicted_) return "";
    return "the sensors contradict each other in " + counted(contradicted_, "frame") +
           ": do both times count from one start, and is it the right rig?";
  }

 private:
  bool as_ndjson_;
  Localizer localizer_;
  LocatedTouches* touches_;
  SecondSensor* second_;
  GivenRig rig_;
  std::int64_t agreed_ = 0, contradicted_ = 0;  // frames in which both are localized
};

/// What ends the frames early, from any thread, also while they are not open yet.
class FrameStopper {
 public:
  void watch(const std::shared_ptr<RawFrameSource>& frames) {
    const std::lock_guard lock(mutex_);
    frames_.push_back(frames);
    if (stopped_) frames->stop();
  }
  void stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    for (const auto& frames : frames_) frames->stop();
  }
  bool stopped() const { return stopped_; }

 private:
  std::mutex mutex_;  // for frames_
  std::vector<std::shared_ptr<RawFrameSource>> frames_;
  std::atomic<bool> stopped_ = false;
};

Session read_map_for(const std::vector<TrackedSensor>& sensors, const std::string& map) {
  Session session = read_map(map);
  for (const std::string& warning : session.warnings) warn(warning);
  for (const TrackedSensor& sensor : sensors)
    check_pixel_pitch(session, sensor.config.sensor.pixel_pitch_mm, map);
  return session;
}

using LineSink = std::function<void(std::string)>;

/// Standard output waits for its reader, so that a log's poses are complete. Other readers may lose lines.
LineSink open_sink(const StreamArguments& arguments, bool quiet) {
  const std::shared_ptr<StreamServer> server = arguments.open_server(quiet);
  if (!server) return [](const std::string& line) { std::cout << line << std::flush; };
  return [server](std::string line) { server->write(std::move(line)); };
}

/// All frames of the stream to the sink, until `stopped`. True when any had a pose.
bool write_poses(SurfaceStream& stream, PoseOutput& output, const LineSink& sink, const FrameStopper& stopper,
                 ProgressSink& progress) {
  for (const std::string& doubt : stream.background_doubts()) warn(doubt);
  progress.begin("tracking", stream.frame_count());
  bool any = false;
  std::int64_t done = 0;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    PoseLine line = output.line(*item);
    any = line.has_pose || any;
    if (!line.text.empty()) sink(std::move(line.text));
    progress.update(++done);
    if (stopper.stopped() || !std::cout) break;
  }
  progress.end();
  warn(stream.warning());
  warn(output.warning());
  return any;
}

void check(const TrackArguments& arguments) {
  if (!arguments.cameras.empty() && !arguments.logs.empty())
    throw Error("give either LOG or --camera, not both");
  if (arguments.cameras.empty() && arguments.logs.empty()) throw Error("give a LOG, or --camera");
  if (arguments.window.shows_map() && arguments.map.empty())
    throw Error("--window and --snapshot need --map; gelslam scan and replay show a sensor without a map");
}

/// One, or two that are fixed to each other.
std::vector<TrackedSensor> find_sensors(const TrackArguments& arguments) {
  const bool is_camera = !arguments.cameras.empty();
  std::vector<std::string> names =
      is_camera ? std::vector<std::string>(arguments.cameras.size()) : arguments.logs;
  if (names.size() == 1 && !is_camera) {
    const auto of_log = sensors_of_log(names.front());
    names.assign(of_log.begin(), of_log.end());
  }
  if (names.size() == 1 && !arguments.rig.empty()) throw Error("--rig is for two sensors");
  if (names.size() == 2 && arguments.map.empty())
    throw Error("two sensors need a map that both are found in: --map RUN");
  std::vector<TrackedSensor> sensors;
  for (std::size_t i = 0; i < names.size(); ++i) {
    LogInput input = arguments.settings.input(names[i], i, names.size());
    if (is_camera) input = with_settings_of_run(std::move(input), arguments.map);
    const Config config = resolve_config(input);
    sensors.push_back({std::move(input), config, is_camera, nullptr});
  }
  return sensors;
}

/// Cameras; logs, in a window at their own rate.
void open_frames(const TrackArguments& arguments, std::vector<TrackedSensor>& sensors,
                 FrameStopper& stopper) {
  if (arguments.cameras.empty() && !arguments.window.window) return;
  std::vector<Config> configs;
  for (const TrackedSensor& sensor : sensors) configs.push_back(sensor.config);
  std::vector<CameraInput> cameras = open_camera_inputs(configs, arguments.cameras);
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    TrackedSensor& sensor = sensors[i];
    sensor.frames = cameras.empty() ? pace(open_raw_log(sensor.input.log, sensor.config.sensor))
                                    : std::move(cameras[i].frames);
    stopper.watch(sensor.frames);
  }
}

int run(const TrackArguments& arguments) {
  check(arguments);
  std::vector<TrackedSensor> sensors = find_sensors(arguments);
  const Config& config = sensors.front().config;
  const bool as_ndjson = arguments.stream.stream_format() == StreamFormat::ndjson;
  const bool shows_poses = arguments.stream.target == "-" && ::isatty(STDOUT_FILENO) != 0;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet || shows_poses);
  const LineSink sink = open_sink(arguments.stream, arguments.quiet);
  const Session map = arguments.map.empty() ? Session() : read_map_for(sensors, arguments.map);
  GivenRig rig;
  if (sensors.size() == 2)
    rig = read_given_rig(arguments.rig.empty() ? arguments.map : arguments.rig, arguments.opening);
  WindowOptions window = arguments.window.window_options();
  const ShownMap shown =
      arguments.window.shows_map() ? read_shown_map(arguments.map, map, *progress) : ShownMap();
  LocatedTouches touches;
  FrameStopper stopper;
  const InterruptStopper interrupt(
      arguments.cameras.empty() ? InterruptWatch::Ends::early : InterruptWatch::Ends::regularly,
      [&stopper] { stopper.stop(); });
  const auto compute = [&] {
    std::shared_ptr<const SurfaceMap> surfaces;
    if (!arguments.map.empty())
      surfaces = std::make_shared<const SurfaceMap>(map.patches, config.slam, progress.get());
    open_frames(arguments, sensors, stopper);
    StageTimer timer;
    SurfaceStream stream = open_stream(sensors.front(), timer);
    std::unique_ptr<SecondSensor> second;
    if (sensors.size() == 2) second = std::make_unique<SecondSensor>(sensors.back(), surfaces, timer);
    std::unique_ptr<PoseOutput> output;
    if (surfaces)
      output =
          std::make_unique<MapOutput>(surfaces, config.slam, as_ndjson,
                                      arguments.window.shows_map() ? &touches : nullptr, second.get(), rig);
    else
      output = std::make_unique<TrialOutput>(config.slam, as_ndjson);
    const bool any = write_poses(stream, *output, sink, stopper, *progress);
    if (second && !second->warning().empty()) warn("second sensor: " + second->warning());
    return any;
  };
  bool any = false;
  if (arguments.window.window) {
    window.asks_to_end = [&interrupt] { return interrupt.requested(); };
    any = compute_in_window(
        compute, [&stopper] { stopper.stop(); }, shown, touches, std::move(window));
  } else {
    any = compute();
    if (arguments.window.shows_map()) write_map_snapshot(shown, touches, arguments.window.snapshot);
  }
  return any ? kExitDone : kExitNotGood;
}

}  // namespace

void add_track_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<TrackArguments>();
  CLI::App* command =
      app.add_subcommand("track", "Stream the sensor's pose against the object, frame by frame");
  command
      ->add_option(
          "LOG", arguments->logs,
          "Recorded log, video, folder of images, or data folder (config.yaml, gelsight.avi); two of "
          "them, or one of two sensors, with --map: sensors that are fixed to each other")
      ->expected(0, 2);
  arguments->settings.add_to(*command);
  CLI::Option* camera =
      command
          ->add_option("--camera", arguments->cameras,
                       "A camera instead of LOG: a path, a number or part of its name (default: the "
                       "configuration's). Twice: of two sensors")
          ->expected(0, 2)
          ->allow_extra_args(false);
  command->add_option(
      "--map", arguments->map,
      "Poses in this map: a run folder (whose configuration and model a camera then has by default), "
      "its session, or a folder made by gelslam map");
  command->add_option(
      "--rig", arguments->rig,
      "Of two sensors: how they are fixed to each other (rig.yaml, or a run of theirs; default: "
      "the map's run)");
  add_opening_option(*command, arguments->opening)->needs("--rig")->excludes(camera);
  arguments->window.add_to(*command);
  arguments->stream.add_to(*command);
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Examples:\n  gelslam track data/pebble --format ndjson\n"
      "  gelslam track --camera --map runs/pebble --format ndjson\n"
      "  gelslam track --camera --map runs/pebble --window > poses.tum\n"
      "  gelslam track left.mkv right.mkv --map runs/held");
  command->callback([arguments, camera, &exit_code] {
    if (camera->count() > 0 && arguments->cameras.empty()) arguments->cameras = {""};
    exit_code = run(*arguments);
  });
}

}  // namespace gelslam
