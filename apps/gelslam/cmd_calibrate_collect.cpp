#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include "calibrate_commands.hpp"
#include "camera_input.hpp"
#include "collect_session.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/viewer/gl_context.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct CollectArguments {
  CollectOptions collect;
  fs::path log, config, snapshot;
  std::string device;
  std::optional<double> pitch_mm;
  bool headless = false, no_labels = false, overwrite = false, quiet = false;
};

std::unique_ptr<RawFrameSource> open_source(const CollectArguments& arguments, const Config& config) {
  if (arguments.log.empty()) return open_camera_input(config, arguments.device).frames;
  std::unique_ptr<RawFrameSource> log = open_raw_log(arguments.log, config.sensor);
  return arguments.headless ? std::move(log) : pace(std::move(log));
}

/// The session on a thread of its own, the window on this one.
void run_in_window(CollectSession& session, const CollectWindowOptions& window) {
  std::exception_ptr failure;
  {
    const std::jthread thread([&] {
      try {
        session.run();
      } catch (...) {
        failure = std::current_exception();
      }
      if (failure) session.close();  // after a log's end the window stays, to be looked at
    });
    try {
      run_collect_window(session, window);
    } catch (...) {
      session.stop();
      throw;
    }
    session.stop();
  }
  if (failure) std::rethrow_exception(failure);
}

int run_collect(CollectArguments arguments) {
  check_output_file(arguments.snapshot, arguments.overwrite);
  LogInput input;
  input.log = arguments.log;
  input.config = arguments.config;
  Config config = find_config(input);
  if (arguments.pitch_mm) config.sensor.pixel_pitch_mm = *arguments.pitch_mm;
  CollectWindowOptions window;
  window.snapshot = arguments.snapshot;
  // Where no window can be opened, no camera should have been disturbed.
  if (!arguments.headless) GlContext::window({.title = "GelSLAM", .visible = false});
  CollectOptions& collect = arguments.collect;
  const std::optional<SensorOptics> folder_optics = find_optics(collect.folder / "catalog.csv");
  collect.optics = folder_optics.value_or(config.surface.optics);
  collect.keep_optics =  // not what any such sensor has
      !folder_optics && (config.optics_from == "log" || config.optics_from == "configuration");
  PressFolder folder(collect.folder, collect.diameter_mm, !arguments.no_labels);  // nor with a wrong folder
  const std::unique_ptr<RawFrameSource> source = open_source(arguments, config);
  collect.until_enough = arguments.headless;
  const auto say = [&](const std::string& words) {
    if (!arguments.quiet) std::cerr << words << "\n";
  };
  CollectSession session(*source, config.sensor, std::move(folder), collect, say);
  const InterruptStopper stopper(
      arguments.log.empty() ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early, [&] {
        session.stop();
        session.close();
      });
  try {
    if (arguments.headless) {
      session.run();
      if (!window.snapshot.empty()) write_collect_snapshot(session, window);
    } else {
      run_in_window(session, window);
    }
  } catch (const Error&) {
    if (session.taken_now() > 0) std::cerr << "kept: " << session.summary() << "\n";
    throw;
  }
  warn(source->warning());
  std::cout << session.summary() << "\n";
  if (!arguments.quiet)
    std::cerr << (session.enough() ? "next: gelslam calibrate train "
                                   : "continue with the same command; or: gelslam calibrate train ")
              << arguments.collect.folder.string() << " -o model.json\n";
  return session.enough() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_calibrate_collect_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("collect", "Collect ball presses automatically");
  const auto arguments = std::make_shared<CollectArguments>();
  CollectOptions& collect = arguments->collect;
  CLI::Option* log = command->add_option("LOG", arguments->log, "Log of presses, instead of a camera");
  command->add_option("-o,--output", collect.folder, "Calibration folder: a new one, or one to continue")
      ->required();
  command->add_option("--diameter", collect.diameter_mm, "Diameter of the ball, mm")
      ->required()
      ->check(number_between(0.5, 100.0));
  command
      ->add_option("--camera", arguments->device,
                   "Camera: /dev/video2, 2, or part of its name (default: the configuration's)")
      ->excludes(log);
  command
      ->add_option("--presses", collect.presses,
                   "Presses wanted of this ball, including those already there; at least 9, one in each "
                   "ninth of the gel")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--config", arguments->config, "The sensor's configuration");
  command->add_option("--pitch", arguments->pitch_mm, "Millimeters per pixel (default: the configuration's)")
      ->check(number_between(1e-4, 10.0));
  command->add_flag("--no-labels", arguments->no_labels, "Do not write the circles as label.npz");
  command->add_flag("--force", collect.any_background,
                    "Take the first still pictures as the bare gel, whatever they show");
  command->add_flag("--headless", arguments->headless,
                    "No window: messages in the terminal; ends when there are enough presses");
  command
      ->add_option("--snapshot", arguments->snapshot,
                   "Picture of the window at the end (PNG; also with --headless)")
      ->check(refuse_unless_png);
  add_overwrite_flag(*command, arguments->overwrite);
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Begin with nothing on the gel. Press, hold still, lift; Ctrl-C ends, and all presses are kept.\n"
      "Exit code 1: presses are still missing.\n"
      "Example: gelslam calibrate collect -o PRESSES --diameter 6.35");
  command->callback([arguments, &exit_code] { exit_code = run_collect(*arguments); });
}

}  // namespace gelslam
