#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "gelslam/slam/surface_stream.hpp"

namespace gelslam {

/// Options and functions that several commands share.

/// The options by which every command that reads logs finds their configuration, model and background.
struct LogOptions {
  std::string config, model, background, background_frames, time = "clock";
  bool force = false;
  int track = 0;

  void add_to(CLI::App& command);
  /// Returns the range of --background-frames A-B.
  std::optional<FrameRange> named_frames() const;
  LogInput input(const std::string& log) const;
};

/// Returns a text as one line for the terminal. Advice of the libraries ("overwrite it", "continue with
/// force") is replaced by the name of the option that does it.
std::string terminal_line(std::string words);

/// Prints terminal_line() on stderr. To be used for all texts that come from files.
void print_line(const std::string& words);

/// --track, for a video with several tracks.
void add_track_option(CLI::App& command, int& track);

/// Prints on stderr in which unit a mesh file was read if the file does not contain it.
void say_mesh_unit(const std::filesystem::path& file);

/// --overwrite, in every command that writes a file or folder.
void add_overwrite_flag(CLI::App& command, bool& overwrite);
/// Checks a file that the user names as output, before any long work (for folders see RunFolder). "" means no
/// file. Throws Error when the file's folder does not exist, when the file exists and must not be
/// overwritten, and always when it is a recording or not a regular file.
void check_output_file(const std::filesystem::path& file, bool overwrite);

/// --keep-free, in every command that records.
void add_keep_free_option(CLI::App& command, std::int64_t& bytes);

/// Parses "12-21" or "1280x800": two integers that are not negative, and nothing else.
std::optional<std::pair<int, int>> two_numbers(const std::string& text, char between);

/// Checks of option values, which return "" or the reason for a refusal.
/// The file of an image must end in .png.
std::string refuse_unless_png(const std::string& path);
/// Accepts a number and nothing else: no comma, no unit.
CLI::Validator number_between(double least, double most);
/// For CLI::Option::transform(). CLI11 itself reads 010 as 8, and -1 as the largest unsigned number.
CLI::Validator whole_number(std::int64_t least, std::int64_t most);

}  // namespace gelslam
