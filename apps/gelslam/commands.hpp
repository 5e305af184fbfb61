#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <type_traits>

namespace gelslam {

/// What the program hands back to the shell.
inline constexpr int kExitDone = 0;
inline constexpr int kExitNotGood = 1;        ///< done, but the result is poor (e.g. never in contact)
inline constexpr int kExitUserError = 2;      ///< gelslam::Error or a wrong command line
inline constexpr int kExitInternalError = 3;  ///< our mistake
/// Plus the signal's number: stopped before the end of its work (130: Ctrl-C). What it has saved stays.
inline constexpr int kExitStoppedBySignal = 128;

/// Options of a command, to be filled by its line; `run` does the work then and returns the exit code.
template <typename Options>
std::remove_const_t<Options>& options_of(CLI::App& command, int& exit_code, int (*run)(Options&)) {
  const auto options = std::make_shared<std::remove_const_t<Options>>();
  command.callback([options, run, &exit_code] { exit_code = run(*options); });
  return *options;
}

/// Each command lives in its own cmd_<name>.cpp: it adds a subcommand with its options, an example as footer,
/// and a function that does the work. Mistakes are thrown as Error; main prints them.
/// Here and in main.cpp they are in alphabetical order.
void add_calibrate_command(CLI::App& app, int& exit_code);
void add_devices_command(CLI::App& app, int& exit_code);
void add_evaluate_command(CLI::App& app, int& exit_code);
void add_export_command(CLI::App& app, int& exit_code);
void add_fuse_command(CLI::App& app, int& exit_code);
void add_info_command(CLI::App& app, int& exit_code);
void add_map_command(CLI::App& app, int& exit_code);
void add_reconstruct_command(CLI::App& app, int& exit_code);
void add_record_command(CLI::App& app, int& exit_code);
void add_scan_command(CLI::App& app, int& exit_code);
void add_simulate_command(CLI::App& app, int& exit_code);
void add_surface_command(CLI::App& app, int& exit_code);
void add_track_command(CLI::App& app, int& exit_code);
void add_view_command(CLI::App& app, int& exit_code);

}  // namespace gelslam
