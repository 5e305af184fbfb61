#include <unistd.h>

#include <atomic>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/pose_stream.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "gelslam/slam/trial_places.hpp"
#include "stream_arguments.hpp"
#include "terminal_progress.hpp"
#include "track_window.hpp"

namespace gelslam {
namespace {

struct TrackArguments {
  LogOptions log;
  std::optional<std::string> camera;
  std::string map;
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

/// Poses in the frame of a map, and what `touches` (or null) shows of them.
class MapOutput final : public PoseOutput {
 public:
  MapOutput(const std::vector<PosedSurface>& map, const SlamOptions& options, bool as_ndjson,
            LocatedTouches* touches, ProgressSink& progress)
      : as_ndjson_(as_ndjson),
        localizer_(std::make_shared<const SurfaceMap>(map, options, &progress), options),
        touches_(touches) {}

  PoseLine line(const SurfaceStream::Item& item) override {
    LocalizedFrame frame;
    if (item.surface)
      frame = localizer_.process(item.frame, item.time_s, item.surface);
    else
      frame.tracked = background_frame(item);
    if (touches_ != nullptr) {
      const auto touch =
          std::make_shared<const LocatedTouch>(LocatedTouch{item.picture, item.surface, frame});
      touches_->newest = touch;
      if (!frame.hypotheses.empty()) touches_->placed = touch;
    }
    const bool localized = frame.status == PlaceStatus::localized;
    if (as_ndjson_) return {map_json(frame, item.surface.get()).dump() + "\n", localized};
    return {localized ? tum_line(item.time_s, frame.hypotheses.front().map_T_sensor) : "", localized};
  }

 private:
  bool as_ndjson_;
  Localizer localizer_;
  LocatedTouches* touches_;
};

Session read_map_for(const SensorProfile& sensor, const std::string& map) {
  Session session = read_map(map);
  for (const std::string& warning : session.warnings) std::cerr << "warning: " << warning << "\n";
  check_pixel_pitch(session, sensor.pixel_pitch_mm, map);
  return session;
}

using LineSink = std::function<void(std::string)>;

/// Standard output waits for its reader, so that a log's poses are complete. Other readers may lose lines.
LineSink open_sink(const StreamArguments& arguments, bool quiet) {
  const std::shared_ptr<StreamServer> server = arguments.open_server(quiet);
  if (!server) return [](const std::string& line) { std::cout << line << std::flush; };
  return [server](std::string line) { server->write(std::move(line)); };
}

/// What ends the frames early, from any thread, also while they are not open yet.
class FrameStopper {
 public:
  void watch(const std::shared_ptr<RawFrameSource>& frames) {
    frames_ = frames;
    if (stopped_) stop();
  }
  void stop() {
    stopped_ = true;
    if (const std::shared_ptr<RawFrameSource> frames = frames_) frames->stop();
  }
  bool stopped() const { return stopped_; }

 private:
  std::atomic<std::shared_ptr<RawFrameSource>> frames_;
  std::atomic<bool> stopped_ = false;
};

/// All frames of the stream to the sink, until `stopped`. True when any had a pose.
bool write_poses(SurfaceStream& stream, PoseOutput& output, const LineSink& sink, const FrameStopper& stopper,
                 ProgressSink& progress) {
  for (const std::string& doubt : stream.background_doubts()) std::cerr << "warning: " << doubt << "\n";
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
  if (!stream.warning().empty()) std::cerr << "warning: " << stream.warning() << "\n";
  return any;
}

void check(const TrackArguments& arguments) {
  if (arguments.camera && !arguments.log.log.empty()) throw Error("give either LOG or --camera, not both");
  if (!arguments.camera && arguments.log.log.empty()) throw Error("give a LOG, or --camera");
  if (arguments.window.shows_map() && arguments.map.empty())
    throw Error("--window and --snapshot need --map; gelslam scan and replay show a sensor without a map");
}

/// A camera; a log, in a window at its own rate.
SurfaceStream open_stream(const TrackArguments& arguments, const LogInput& input, const Config& config,
                          StageTimer& timer, FrameStopper& stopper) {
  if (!arguments.camera && !arguments.window.window) return {input, config, timer};
  std::shared_ptr<RawFrameSource> frames;
  std::function<void(const std::string&)> ask;
  if (arguments.camera) {
    frames = open_camera_input(config, *arguments.camera).frames;
    ask = [](const std::string& request) { std::cerr << "gelslam: " << request << "\n"; };
  } else {
    frames = pace(open_raw_log(input.log, config.sensor));
  }
  stopper.watch(frames);
  const std::string name = arguments.camera ? "camera" : input.log.string();
  return {decode_frames(frames, name, config.sensor), input, config, timer, ask};
}

std::unique_ptr<PoseOutput> make_output(const TrackArguments& arguments, const Config& config,
                                        const std::vector<PosedSurface>& map, LocatedTouches& touches,
                                        ProgressSink& progress) {
  const bool as_ndjson = arguments.stream.stream_format() == StreamFormat::ndjson;
  if (arguments.map.empty()) return std::make_unique<TrialOutput>(config.slam, as_ndjson);
  return std::make_unique<MapOutput>(map, config.slam, as_ndjson,
                                     arguments.window.shows_map() ? &touches : nullptr, progress);
}

int run(const TrackArguments& arguments) {
  check(arguments);
  LogInput input = arguments.log.input();
  if (arguments.camera) input = with_settings_of_run(std::move(input), arguments.map);
  const Config config = resolve_config(input);
  const bool shows_poses = arguments.stream.target == "-" && ::isatty(STDOUT_FILENO) != 0;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet || shows_poses);
  const LineSink sink = open_sink(arguments.stream, arguments.quiet);
  const Session map = arguments.map.empty() ? Session() : read_map_for(config.sensor, arguments.map);
  WindowOptions window = arguments.window.window_options();
  const ShownMap shown =
      arguments.window.shows_map() ? read_shown_map(arguments.map, map, *progress) : ShownMap();
  LocatedTouches touches;
  FrameStopper stopper;
  const InterruptStopper interrupt(
      arguments.camera ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early,
      [&stopper] { stopper.stop(); });
  const auto compute = [&] {
    const std::unique_ptr<PoseOutput> output =
        make_output(arguments, config, map.patches, touches, *progress);
    StageTimer timer;
    SurfaceStream stream = open_stream(arguments, input, config, timer, stopper);
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
  arguments->log.add_to(*command);
  command->get_option("LOG")->required(false);
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
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
