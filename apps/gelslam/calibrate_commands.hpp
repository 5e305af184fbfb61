#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {

/// The subcommands of `gelslam calibrate`; each in its own cmd_calibrate_<name>.cpp.
void add_calibrate_check_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_collect_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_optics_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_scale_command(CLI::App& calibrate, int& exit_code);
void add_calibrate_train_command(CLI::App& calibrate, int& exit_code);

/// What the commands that read presses have in common.
struct PressOptions {
  std::filesystem::path folder, config;
  bool quiet = false;
  bool force = false;  ///< presses whose untouched gel does not look like the background, too
  // From the configuration, once read_presses() has read it.
  double pitch_mm = 0.0634;

  void add_to(CLI::App& command);
};

/// Reads the configuration, if one is given, and the presses. Throws Error also like
/// require_readable_background(); warnings are said on stderr. `model`: that the presses are read with. Its
/// pitch is used where no other is given; optics are those of the model, else of optics.yaml, else of the
/// configuration.
PressSet read_presses(PressOptions& options, const ModelFile& model = {});

}  // namespace gelslam
