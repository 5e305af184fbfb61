#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/line_feed.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/viewer/map_window.hpp"
#include "reports.hpp"
#include "stream_arguments.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

/// Options for showing the map in which the sensor is localized.
struct MapWindowArguments {
  bool window = false, overwrite = false;
  std::string snapshot;

  void add_to(CLI::App& command) {
    command.add_flag("--window", window,
                     "Show the map and the touch in it while poses are written; a LOG plays at its rate");
    command
        .add_option(
            "--snapshot", snapshot,
            "Picture (PNG) of the window at the end, or, without --window, of the last touch in the map")
        ->check(refuse_unless_png);
    add_overwrite_flag(command, overwrite);
  }
  bool shows_map() const { return window || !snapshot.empty(); }
  /// Throws Error when the snapshot may not be written or there is no display.
  WindowOptions window_options() const {
    check_output_file(snapshot, overwrite);
    WindowOptions options;
    options.snapshot = snapshot;
    if (window) viewer::require_display();
    return options;
  }
};

struct TrackArguments {
  std::string log, camera;
  bool is_camera = false;  ///< `camera` may be "": the device of the configuration.
  LogOptions settings;
  std::string map;
  StreamArguments stream{.target = "-", .format = ""};  ///< Empty format: tum with a map, else ndjson.
  MapWindowArguments window;
  bool quiet = false;
};

/// Ends the frames early, from any thread, even before they are opened.
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
  std::mutex mutex_;  // Protects frames_.
  std::shared_ptr<RawFrameSource> frames_;
  std::atomic<bool> stopped_ = false;
};

MapSnapshot read_map_for(const Config& config, const std::string& map) {
  MapSnapshot session = read_map(map);
  if (!session.warning.empty()) warn(session.warning);
  check_pixel_pitch(posed_surfaces(session), config.sensor.pixel_pitch_mm, map);
  return session;
}

/// Returns a report for a frame; called for every frame in order. Its `in_map` is the pose in the output.
using FrameLocator = std::function<FrameReport(const SurfaceStream::Item&)>;

/// Poses are in the frame of `map` or, if it is null, in the frame of the trial.
FrameLocator make_locator(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options) {
  if (map) {
    const auto localizer = std::make_shared<Localizer>(std::move(map), options);
    return [localizer](const SurfaceStream::Item& item) {
      const TactileImage& image = item.image;
      FrameReport report = localizer->process(image.index, image.time_s, item.surface, image.unix_us);
      report.image = image.bgr;
      return report;
    };
  }
  const auto tracker = std::make_shared<Tracker>(options.tracker, options.registration, options.verification);
  const auto trials = std::make_shared<TrialMap>(options.gradient_scale);
  return [tracker, trials](const SurfaceStream::Item& item) {
    const TactileImage& image = item.image;
    FrameReport report{.tracked = tracker->track(image.index, image.time_s, item.surface, image.unix_us),
                       .image = image.bgr,
                       .surface = item.surface};
    report.in_trial = report.in_map = trials->add(report.tracked);
    return report;
  };
}

/// Writes the line of each frame and provides the state that the service shows. Standard output waits for its
/// reader, so that a log's poses are complete; other readers may lose lines.
class PoseOutlet {
 public:
  PoseOutlet(const StreamArguments& arguments, bool quiet)
      : tum_(arguments.is_tum()), service_(open_service(arguments.serve, feed_, nullptr, quiet)) {}
  ~PoseOutlet() {
    if (!service_) return;
    feed_.close();
    watch_.reset();
    service_->finish();
  }

  void watch(std::function<void()> stop) {
    if (!service_) return;
    WatchedScan scan;
    scan.status = [this] { return copy(status_); };
    scan.touch = [this] { return copy(touch_); };
    scan.ask = [stop = std::move(stop)](ScanCommand) { stop(); };
    status_.is_scan = false;
    watch_ = service_->watch(std::move(scan));
  }
  void write(const std::shared_ptr<const FrameReport>& report, const std::string& source) {
    if (!service_) {  // Not both, because a pipe that nobody reads would block the service.
      std::cout << (tum_ ? tum_line(*report) : ndjson_line(*report)) << std::flush;
      return;
    }
    show(report, source);
    feed_.write(*report);
  }
  void end() {
    const std::lock_guard lock(mutex_);
    status_.phase = LivePhase::finished;
  }

 private:
  template <typename T>
  T copy(const T& shown) const {
    const std::lock_guard lock(mutex_);
    return shown;
  }
  void show(const std::shared_ptr<const FrameReport>& touch, const std::string& source) {
    const FrameReport& report = *touch;
    const bool lost = report.has_contact() && report.known_place() == nullptr;
    const std::lock_guard lock(mutex_);
    touch_ = touch;
    status_.phase = report.surface ? LivePhase::scanning : LivePhase::background;
    status_.track = lost ? TrackStatus::lost : report.tracked.status;
    status_.state = lost || (report.has_contact() && report.localization) ? status_name(report) : "";
    status_.reason = lost ? reason_of(report) : "";
    status_.source = source;
    ++status_.frames;
  }

  const bool tum_;
  LineFeed feed_;
  mutable std::mutex mutex_;  // Protects the members below.
  LiveStatus status_;
  std::shared_ptr<const FrameReport> touch_;
  std::unique_ptr<HttpService> service_;
  std::shared_ptr<void> watch_;
};

/// Summary of a stream, printed for users who do not read it.
struct PoseSummary {
  std::int64_t frames = 0, posed = 0;
  std::int64_t first_frame = 0;  ///< First frame that had a pose.
  double first_s = 0;
  Eigen::Vector3d first_mm = Eigen::Vector3d::Zero();
  std::map<std::string, int> why_without;  ///< Frames with contact but without a pose, counted by reason.

  void add(const FrameReport& report) {
    ++frames;
    const TrackedFrame& tracked = report.tracked;
    if (const MapPlace* place = report.known_place()) {
      if (posed++ > 0) return;
      first_frame = tracked.frame;
      first_s = tracked.time_s;
      first_mm = place->map_T_frame.pose.translation();
    } else if (report.has_contact()) {
      ++why_without[fmt::format("{}: {}", status_name(report), reason_of(report))];
    }
  }
  std::string words(bool in_map) const {
    const char* what = in_map ? "localized" : "tracked";
    if (posed == 0 && why_without.empty()) return fmt::format("never {}: nothing was touched", what);
    if (posed == 0) {
      const auto& why = std::ranges::max_element(why_without, {}, [](const auto& w) { return w.second; });
      return fmt::format("never {}: {} ({} of {})", what, why->first, why->second, counted(frames, "frame"));
    }
    const std::string place =
        fmt::format(" at ({:.1f}, {:.1f}, {:.1f}) mm", first_mm.x(), first_mm.y(), first_mm.z());
    return fmt::format("{} in {} of {}, first in frame {} ({:.2f} s){}", what, posed,
                       counted(frames, "frame"), first_frame, first_s, in_map ? place : "");
  }
};

/// Passes all frames of the stream to the outlet and `touches` (may be null), until `stopped`.
PoseSummary write_poses(SurfaceStream& stream, const FrameLocator& locate, PoseOutlet& outlet,
                        LocatedTouches* touches, const FrameStopper& stopper, ProgressSink& progress) {
  for (const std::string& warning : stream.background_warnings()) warn(warning);
  progress.begin("tracking", stream.frame_count());
  PoseSummary summary;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    const auto report = std::make_shared<const FrameReport>(locate(*item));
    summary.add(*report);
    outlet.write(report, stream.description());
    if (touches != nullptr) {
      touches->newest = report;
      if (report->localization && !report->localization->hypotheses.empty()) touches->placed = report;
    }
    progress.update(summary.frames);
    if (stopper.stopped() || !std::cout) break;
  }
  outlet.end();
  progress.end();
  warn(stream.warning());
  return summary;
}

void check(const TrackArguments& arguments) {
  arguments.stream.check();
  if (arguments.is_camera && !arguments.log.empty()) throw Error("give either LOG or --camera, not both");
  if (!arguments.is_camera && arguments.log.empty()) throw Error("give a LOG, or --camera");
  if (arguments.stream.is_tum() && arguments.map.empty())
    throw Error("--format tum needs --map; gelslam reconstruct writes the trajectory of a log");
  if (arguments.window.shows_map() && arguments.map.empty())
    throw Error("--window and --snapshot need --map; gelslam scan shows a sensor without a map");
}

/// Opens a camera, or a log; with a window the log is replayed at its own rate.
SurfaceStream open_stream(const TrackArguments& arguments, const LogInput& input, const Config& config,
                          FrameStopper& stopper, StageTimer& timer) {
  if (!arguments.is_camera && !arguments.window.window) return {input, config, timer};
  const std::shared_ptr<RawFrameSource> frames = arguments.is_camera
                                                     ? open_camera_input(config, arguments.camera).frames
                                                     : pace(open_raw_log(input.log, config.sensor));
  stopper.watch(frames);
  std::function<void(const std::string&)> ask;
  if (arguments.is_camera) ask = [](const std::string& request) { print_line("gelslam: " + request); };
  const std::string name = arguments.is_camera ? "camera" : input.log.string();
  return {std::make_unique<FrameSource>(frames, name, config.sensor), input, config, timer, ask};
}

/// Returns the mesh in a map's folder or, if there is none, the fused surfaces of `session`. Throws Error.
ShownMap read_shown_map(const std::string& folder, const MapSnapshot& session, ProgressSink& progress) {
  const std::filesystem::path mesh = std::filesystem::path(folder) / "mesh.ply";
  ShownMap map{folder, {}, session.gradient_scale.mean()};
  if (std::filesystem::exists(mesh))
    map.mesh = read_mesh(mesh);
  else
    map.mesh = fuse(posed_surfaces(session), {}, map.gradient_scale, &progress);
  return map;
}

/// Shows `touches` while `compute` runs. Throws what it threw, unless it was stopped before it could begin.
void compute_in_window(const std::function<void()>& compute, const std::function<void()>& stop,
                       const ShownMap& map, LocatedTouches& touches, WindowOptions options) {
  std::atomic<bool> failed = false, closed = false;
  options.asks_to_end = [&failed, asks = std::move(options.asks_to_end)] { return failed || asks(); };
  const auto work = [&] {
    try {
      compute();
      touches.have_ended = true;
    } catch (...) {
      if (closed) return;  // It was stopped before the background was complete.
      failed = true;
      throw;
    }
  };
  const auto show = [&] {
    lower_thread_priority();  // Localization has priority over drawing.
    run_map_window(map, touches, options);
  };
  work_beside_window(work, show, [&] {
    closed = true;
    stop();
  });
}

int run(TrackArguments& arguments) {
  check(arguments);
  use_simulated_model(arguments.camera, arguments.settings.model);
  LogInput input = arguments.settings.input(arguments.log);
  if (arguments.is_camera) input = with_settings_of_run(std::move(input), arguments.map);
  const Config config = resolve_config(input);
  const bool shows_poses = ::isatty(STDOUT_FILENO) != 0;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet || shows_poses);
  FrameStopper stopper;  // Must outlive the outlet, whose clients may use it.
  PoseOutlet outlet(arguments.stream, arguments.quiet);
  const MapSnapshot map = arguments.map.empty() ? MapSnapshot() : read_map_for(config, arguments.map);
  WindowOptions window = arguments.window.window_options();
  const ShownMap shown =
      arguments.window.shows_map() ? read_shown_map(arguments.map, map, *progress) : ShownMap();
  LocatedTouches touches;
  const auto stop = [&stopper] { stopper.stop(); };
  outlet.watch(stop);
  const InterruptStopper interrupt(
      arguments.is_camera ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early, stop);
  const auto compute = [&] {
    std::shared_ptr<const SurfaceMap> surfaces;
    if (!arguments.map.empty())
      surfaces = std::make_shared<const SurfaceMap>(posed_surfaces(map), config.slam, progress.get());
    StageTimer timer;
    SurfaceStream stream = open_stream(arguments, input, config, stopper, timer);
    return write_poses(stream, make_locator(std::move(surfaces), config.slam), outlet,
                       arguments.window.shows_map() ? &touches : nullptr, stopper, *progress);
  };
  PoseSummary summary;
  if (arguments.window.window) {
    window.asks_to_end = [&interrupt] { return interrupt.requested(); };
    compute_in_window([&] { summary = compute(); }, stop, shown, touches, std::move(window));
  } else {
    summary = compute();
    if (arguments.window.shows_map()) write_map_snapshot(shown, touches, arguments.window.snapshot);
  }
  if (!arguments.quiet || summary.posed == 0) print_line(summary.words(!arguments.map.empty()));
  return summary.posed > 0 ? kExitDone : kExitNotGood;
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
                       "configuration's), or \"simulated\"")
          ->expected(0, 1);
  command->add_option(
      "--map", arguments->map,
      "Poses in this map: a run folder (whose configuration and model a camera then has by default), "
      "its session, or a folder made by gelslam map");
  arguments->window.add_to(*command);
  arguments->stream.add_to(*command);
  command->get_option("--format")->default_str("ndjson; with --map, tum");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Examples:\n  gelslam track data/pebble\n"
      "  gelslam track --camera --map runs/pebble --format ndjson\n"
      "  gelslam track --camera --map runs/pebble --window > poses.tum");
  command->callback([arguments, camera, &exit_code] {
    arguments->is_camera = camera->count() > 0;
    StreamArguments& stream = arguments->stream;
    stream.serve.tum = !arguments->map.empty();
    if (stream.format.empty()) stream.format = stream.serve.tum ? "tum" : "ndjson";
    exit_code = run(*arguments);
  });
}

}  // namespace gelslam
