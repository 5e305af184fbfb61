#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/slam/config.hpp"
#include "terminal_progress.hpp"

namespace gelslam {

void PressOptions::add_to(CLI::App& command) {
  command
      .add_option("PRESSES", folder, "Calibration folder: catalog.csv, background.png, a folder per press")
      ->required();
  command.add_option("--config", config,
                     "The sensor's configuration: its name and pixel pitch (default: GelSight Mini)");
  command.add_flag("--force", force,
                   "Use presses whose untouched gel does not look like the background, too");
  add_quiet_flag(command, quiet);
}

PressSet read_presses(PressOptions& options, const ModelFile& model) {
  const Config config = find_config({.config = options.config});
  if (model.record) options.pitch_mm = model.record->pixel_pitch_mm;
  if (!options.config.empty()) options.pitch_mm = config.surface.pixel_pitch_mm;
  PressSet set = read_press_set(options.folder, options.force);
  if (model.model.optics) set.optics = model.model.optics;
  prepare(set, config.surface.optics, options.pitch_mm, config.sensor.device_name,
          [](const std::string& warning) { print_line("note: " + warning); });
  return set;
}

void add_calibrate_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("calibrate", "Make and judge a sensor's model from presses of a ball");
  command->require_subcommand(1);
  for (const auto add :
       {add_calibrate_check_command, add_calibrate_collect_command, add_calibrate_optics_command,
        add_calibrate_scale_command, add_calibrate_train_command})
    add(*command, exit_code);
  command->footer(
      "The usual order: collect, train, check.\n"
      "Example: gelslam calibrate collect -o PRESSES --diameter 6.35 && gelslam calibrate train PRESSES -o "
      "model.json");
}

}  // namespace gelslam
