// The command `gelslam calibrate collect`. With a camera or a log it collects presses of a ball
// (CollectSession). With a calibration folder it labels the presses of that folder (LabelSession).

#include <iostream>
#include <map>
#include <memory>
#include <optional>

#include "calibrate_commands.hpp"
#include "camera_input.hpp"
#include "collect_session.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/label_session.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct CollectArguments {
  CollectOptions collect;
  fs::path input, config;  ///< `input` is a log or a calibration folder.
  std::string device;
  bool quiet = false;
};

std::unique_ptr<RawFrameSource> open_source(const CollectArguments& arguments, const Config& config) {
  if (arguments.input.empty()) return open_camera_input(config, arguments.device).frames;
  std::unique_ptr<RawFrameSource> log = open_raw_log(arguments.input, config.sensor);
  return arguments.collect.headless ? std::move(log) : pace(std::move(log));
}

/// Finds the circles of all existing presses.
LabelSession find_circles(PressSet set, double pitch_mm, bool quiet) {
  StoppableProgress progress(quiet);
  std::vector<FoundCircle> found;
  if (!set.presses.empty()) progress.begin("looking at presses", std::ssize(set.presses));
  for (const CalibrationPress& press : set.presses) {
    found.push_back(find_circle(press.bgr, set.background, set.camera(pitch_mm), press.diameter_mm));
    progress.update(std::ssize(found));
  }
  if (!set.presses.empty()) progress.end();
  return {std::move(set), std::move(found)};
}

/// Labels existing presses: in a window, or by accepting every circle that was found, uncertain ones
/// included.
int label_presses(const CollectArguments& arguments, PressWindowOptions window) {
  if (!arguments.collect.folder.empty() || arguments.collect.diameter_mm > 0)
    throw Error(quoted(arguments.input) + " holds presses to be labeled: leave out --output and --diameter");
  const FolderLock lock(arguments.input);
  PressOptions options{arguments.input, arguments.config, arguments.quiet, arguments.collect.any_background};
  PressSet set = read_presses(options);
  window.pixel_pitch_mm = options.pitch_mm;
  LabelSession labels = find_circles(std::move(set), options.pitch_mm, arguments.quiet);
  if (arguments.collect.headless) {
    labels.accept_rest();
    labels.save();
    // Presses by reason, so that each reason is printed once.
    std::map<std::string, std::vector<std::string>> unclear;
    for (const PressLabel& label : labels.labels())
      if (label.state == LabelState::open)
        unclear[label.warning].push_back(labels.set().presses[label.press].name);
    for (const auto& [why, names] : unclear)
      print_line("not clear: " + names.front() +
                 (names.size() > 1 ? " and " + counted(std::ssize(names) - 1, "other") : "") + ": " + why);
  } else {
    const InterruptWatch interrupt;
    window.asks_to_end = [&] { return interrupt.requested(); };
    run_press_window(labels, nullptr, window);
  }
  const std::size_t open = labels.counts().open();
  std::cout << labels.progress() << (open > 0 ? "; without --headless a window shows the rest" : "") << "\n";
  return open == 0 ? kExitDone : kExitNotGood;
}

int run_collect(CollectArguments& arguments) {
  CollectOptions& collect = arguments.collect;
  if (!arguments.input.empty() && !fs::exists(arguments.input))
    throw Error(quoted(arguments.input) + ": no such file or folder");
  const bool is_labeling = !arguments.input.empty() && fs::exists(arguments.input / "catalog.csv");
  if (!is_labeling && collect.folder.empty()) throw CLI::RequiredError("--output");
  if (!is_labeling && !(collect.diameter_mm > 0)) throw CLI::RequiredError("--diameter");
  PressWindowOptions window;
  // Checked first, so that no camera is opened if no window can be.
  if (!collect.headless) viewer::require_display();
  if (is_labeling) return label_presses(arguments, window);
  const Config config = find_config({.log = arguments.input, .config = arguments.config});
  collect.pixel_pitch_mm = window.pixel_pitch_mm = config.sensor.pixel_pitch_mm;
  const std::optional<SensorOptics> folder_optics = find_optics(collect.folder / "catalog.csv");
  collect.optics = folder_optics.value_or(config.surface.optics);
  collect.keep_optics =  // Only optics of this sensor, and only if the folder has none yet.
      !folder_optics && (config.optics_from == "log" || config.optics_from == "configuration");
  PressFolder folder(collect.folder, collect.diameter_mm);  // Also checked before a camera is opened.
  LabelSession labels = find_circles(folder.earlier(), window.pixel_pitch_mm, arguments.quiet);
  const std::unique_ptr<RawFrameSource> source = open_source(arguments, config);
  const auto say = [&](const std::string& words) {
    if (!arguments.quiet) print_line(words);
  };
  CollectSession session(*source, config.sensor, std::move(folder), collect, say);
  session.count(labels.contacts(collect.diameter_mm));
  const InterruptStopper stopper(
      arguments.input.empty() ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early, [&] {
        session.stop();
        session.close();
      });
  try {
    const auto work = [&] {
      try {
        session.run();
      } catch (...) {
        session.close();  // The window closes if the session fails. At the end of a log it stays open.
        throw;
      }
    };
    if (collect.headless)
      session.run();
    else
      work_beside_window(
          work, [&] { run_press_window(labels, &session, window); }, [&] { session.stop(); });
  } catch (...) {
    if (session.taken_now() > 0) std::cerr << "kept: " << session.summary() << "\n";
    throw;
  }
  warn(source->warning());
  std::cout << session.summary() << "\n";
  if (!arguments.quiet)
    print_line((session.enough() ? "next: gelslam calibrate train "
                                 : "continue with the same command; or: gelslam calibrate train ") +
               collect.folder.string() + " -o model.json");
  return session.enough() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_calibrate_collect_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command =
      calibrate.add_subcommand("collect", "Collect ball presses automatically, and label them");
  auto& arguments = options_of(*command, exit_code, run_collect);
  CollectOptions& collect = arguments.collect;
  CLI::Option* input = command->add_option(
      "INPUT", arguments.input,
      "Instead of a camera: a log of presses, or a calibration folder whose presses are to be labeled");
  command->add_option("-o,--output", collect.folder, "Calibration folder: a new one, or one to continue");
  command->add_option("--diameter", collect.diameter_mm, "Diameter of the ball, mm")
      ->check(number_between(0.5, 100.0));
  command
      ->add_option("--camera", arguments.device,
                   "Camera: /dev/video2, 2, or part of its name (default: the configuration's)")
      ->excludes(input);
  command
      ->add_option("--presses", collect.presses,
                   "Presses wanted of this ball, including those already there; at least 10. Each ninth of "
                   "the gel needs a ninth of them")
      ->transform(whole_number(1, 1000))
      ->capture_default_str();
  command->add_option("--config", arguments.config, "The sensor's configuration");
  command->add_flag(
      "--force", collect.any_background,
      "Take the first still pictures as the bare gel, whatever they show. With a calibration folder: "
      "also use presses whose bare gel does not look like the background");
  command->add_flag("--headless", collect.headless,
                    "No window: messages in the terminal; ends when there are enough presses. Of a folder, "
                    "every contact that was found is accepted");
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Begin with nothing on the gel. Press, hold still, lift; Ctrl-C ends, and all presses are kept.\n"
      "Backspace shows a press. Move its circle with the mouse or the arrow keys; Enter accepts it, X leaves "
      "the press\nout, Q saves and ends.\n"
      "Exit code 1: presses are still missing, not clear, or not decided yet.\n"
      "Example: gelslam calibrate collect -o PRESSES --diameter 6.35\n"
      "         gelslam calibrate collect PRESSES");
}

}  // namespace gelslam
