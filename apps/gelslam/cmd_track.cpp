#include <unistd.h>

#include <atomic>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "reports.hpp"
#include "stream_arguments.hpp"
#include "terminal_progress.hpp"
#include "track_output.hpp"
#include "track_window.hpp"

namespace gelslam {
namespace {

struct TrackArguments {
  std::string log, camera;
  bool is_camera = false;  ///< not a log; `camera` may be "": the configuration's
  LogOptions settings;
  std::string map;
  StreamArguments stream{.target = "-", .format = "tum"};
  MapWindowArguments window;
  bool quiet = false;
};

/// What ends the frames early, from any thread, also while they are not open yet.
class FrameStopper {
 public:
  void watch(const std::shared_ptr<RawFrameSource>& frames) {
    const std::lock_guard lock(mutex_);
    frames_ = frames;
    if (stopped_) frames->stop();
  }
  void stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    if (frames_) frames_->stop();
  }
  bool stopped() const { return stopped_; }

 private:
  std::mutex mutex_;  // for frames_
  std::shared_ptr<RawFrameSource> frames_;
  std::atomic<bool> stopped_ = false;
};

Session read_map_for(const Config& config, const std::string& map) {
  Session session = read_map(map);
  if (!session.warning.empty()) warn(session.warning);
  check_pixel_pitch(session, config.sensor.pixel_pitch_mm, map);
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
  return any;
}

void check(const TrackArguments& arguments) {
  if (arguments.is_camera && !arguments.log.empty()) throw Error("give either LOG or --camera, not both");
  if (!arguments.is_camera && arguments.log.empty()) throw Error("give a LOG, or --camera");
  if (arguments.window.shows_map() && arguments.map.empty())
    throw Error("--window and --snapshot need --map; gelslam scan shows a sensor without a map");
}

/// Of a camera, or of a log, in a window at its own rate.
SurfaceStream open_stream(const TrackArguments& arguments, const LogInput& input, const Config& config,
                          FrameStopper& stopper, StageTimer& timer) {
  if (!arguments.is_camera && !arguments.window.window) return {input, config, timer};
  const std::shared_ptr<RawFrameSource> frames = arguments.is_camera
                                                     ? open_camera_input(config, arguments.camera).frames
                                                     : pace(open_raw_log(input.log, config.sensor));
  stopper.watch(frames);
  std::function<void(const std::string&)> ask;
  if (arguments.is_camera)
    ask = [](const std::string& request) { std::cerr << "gelslam: " << request << "\n"; };
  const std::string name = arguments.is_camera ? "camera" : input.log.string();
  return {std::make_unique<FrameSource>(frames, name, config.sensor), input, config, timer, ask};
}

int run(const TrackArguments& arguments) {
  check(arguments);
  LogInput input = arguments.settings.input(arguments.log);
  if (arguments.is_camera) input = with_settings_of_run(std::move(input), arguments.map);
  const Config config = resolve_config(input);
  const bool as_ndjson = arguments.stream.stream_format() == StreamFormat::ndjson;
  const bool shows_poses = arguments.stream.target == "-" && ::isatty(STDOUT_FILENO) != 0;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet || shows_poses);
  const LineSink sink = open_sink(arguments.stream, arguments.quiet);
  const Session map = arguments.map.empty() ? Session() : read_map_for(config, arguments.map);
  WindowOptions window = arguments.window.window_options();
  const ShownMap shown =
      arguments.window.shows_map() ? read_shown_map(arguments.map, map, *progress) : ShownMap();
  LocatedTouches touches;
  FrameStopper stopper;
  const InterruptStopper interrupt(
      arguments.is_camera ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early,
      [&stopper] { stopper.stop(); });
  const auto compute = [&] {
    std::shared_ptr<const SurfaceMap> surfaces;
    if (!arguments.map.empty())
      surfaces = std::make_shared<const SurfaceMap>(map.patches, config.slam, progress.get());
    StageTimer timer;
    SurfaceStream stream = open_stream(arguments, input, config, stopper, timer);
    const std::unique_ptr<PoseOutput> output =
        surfaces ? make_map_output(surfaces, config.slam, as_ndjson,
                                   arguments.window.shows_map() ? &touches : nullptr)
                 : make_trial_output(config.slam, as_ndjson);
    return write_poses(stream, *output, sink, stopper, *progress);
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
  command->add_option("LOG", arguments->log,
                      "Recorded log, video, folder of images, or data folder (config.yaml, gelsight.avi)");
  arguments->settings.add_to(*command);
  CLI::Option* camera =
      command
          ->add_option("--camera", arguments->camera,
                       "A camera instead of LOG: a path, a number or part of its name (default: the "
                       "configuration's)")
          ->expected(0, 1);
  command->add_option(
      "--map", arguments->map,
      "Poses in this map: a run folder (whose configuration and model a camera then has by default), "
      "its session, or a folder made by gelslam map");
  arguments->window.add_to(*command);
  arguments->stream.add_to(*command);
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Examples:\n  gelslam track data/pebble --format ndjson\n"
      "  gelslam track --camera --map runs/pebble --format ndjson\n"
      "  gelslam track --camera --map runs/pebble --window > poses.tum");
  command->callback([arguments, camera, &exit_code] {
    arguments->is_camera = camera->count() > 0;
    exit_code = run(*arguments);
  });
}

}  // namespace gelslam
