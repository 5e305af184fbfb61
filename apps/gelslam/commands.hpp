#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <type_traits>

namespace gelslam {

/// Exit codes of the program.
inline constexpr int kExitDone = 0;
inline constexpr int kExitNotGood = 1;    ///< Done, but the result is poor (e.g. there was never contact).
inline constexpr int kExitUserError = 2;  ///< A gelslam::Error or a wrong command line.
inline constexpr int kExitInternalError = 3;  ///< A bug of this program.
/// Plus the signal's number: stopped before the end of the work (130: Ctrl-C). What was saved is kept.
inline constexpr int kExitStoppedBySignal = 128;

/// Returns the options of a command, to be filled by its command line. `run` is then called to do the work
/// and returns the exit code.
template <typename Options>
std::remove_const_t<Options>& options_of(CLI::App& command, int& exit_code, int (*run)(Options&)) {
  const auto options = std::make_shared<std::remove_const_t<Options>>();
  command.callback([options, run, &exit_code] { exit_code = run(*options); });
  return *options;
}

/// Each command is in its own cmd_<name>.cpp, which adds a subcommand with its options, an example as footer,
/// and a function that does the work. Errors are thrown as Error and printed by main(). Here and in main.cpp
/// the commands are in alphabetical order.
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
