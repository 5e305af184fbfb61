#include <unistd.h>

#include <atomic>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/sensor_rig.hpp"
#include "reports.hpp"
#include "stream_arguments.hpp"
#include "terminal_progress.hpp"
#include "track_output.hpp"
#include "track_window.hpp"
#include "tracked_sensor.hpp"

namespace gelslam {
namespace {

struct TrackArguments {
  std::vector<std::string> logs;     ///< or
  std::vector<std::string> cameras;  ///< "": the configuration's
  LogOptions settings;
  std::string map, rig;
  StreamArguments stream{.target = "-", .format = "tum"};
  MapWindowArguments window;
  bool quiet = false;
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
  std::cerr << warning_words(stream.warnings());
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
  if (names.size() == 2 && !is_camera) check_two_sensors(names[0], names[1]);
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
  const RigPose rig =
      sensors.size() < 2 ? RigPose() : read_rig(arguments.rig.empty() ? arguments.map : arguments.rig);
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
    const std::unique_ptr<PoseOutput> output =
        surfaces ? make_map_output(surfaces, config.slam, as_ndjson,
                                   arguments.window.shows_map() ? &touches : nullptr, second.get(), rig)
                 : make_trial_output(config.slam, as_ndjson);
    const bool any = write_poses(stream, *output, sink, stopper, *progress);
    if (second)
      for (const std::string& warning : second->warnings()) warn("second sensor: " + warning);
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
