#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {

/// The subcommands of `gelslam calibrate`, each in its own cmd_calibrate_<name>.cpp.
void add_calibrate_check_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_collect_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_optics_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_scale_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_train_command(CLI::App& calibrate, int& exit_code);

/// Options of all commands that read presses.
struct PressOptions {
  std::filesystem::path folder, config;
  bool quiet = false;
  bool force = false;  ///< Also use presses whose untouched gel does not look like the background.
  // Read from the configuration by read_presses().
  double pitch_mm = 0.0634;

  void add_to(CLI::App& command);
};

/// Reads the configuration, if one is given, and the presses. Throws Error, also as
/// require_readable_background(); warnings are printed on stderr. `model` is the gradient model with which
/// the presses will be read: its pixel pitch is used if no other is given. Optics are those of the model,
/// else of optics.yaml, else of the configuration.
PressSet read_presses(PressOptions& options, const ModelFile& model = {});

}  // namespace gelslam
