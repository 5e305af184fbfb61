#pragma once

#include <CLI/CLI.hpp>

namespace gelslam {

/// What the program hands back to the shell.
inline constexpr int kExitDone = 0;
inline constexpr int kExitNotGood = 1;        ///< done, but the result is poor (e.g. never in contact)
inline constexpr int kExitUserError = 2;      ///< gelslam::Error or a wrong command line
inline constexpr int kExitInternalError = 3;  ///< our mistake
/// Plus the signal's number: stopped before the end of its work (130: Ctrl-C). What it has saved stays.
inline constexpr int kExitStoppedBySignal = 128;

/// Each command lives in its own cmd_<name>.cpp: it adds a subcommand with its options, an example as footer,
/// and a callback that does the work and sets `exit_code`. Mistakes are thrown as Error; main prints them.
/// One line here and one in main.cpp per command, in alphabetical order.
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
