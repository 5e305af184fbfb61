#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "gelslam/slam/surface_stream.hpp"

namespace gelslam {

/// What the commands' lines have in common.

/// The options by which every command that reads logs finds their configuration, model and background.
struct LogOptions {
  std::string config, model, background, background_frames, time = "clock";
  bool force = false;
  int track = 0;

  void add_to(CLI::App& command);
  /// Of --background-frames A-B.
  std::optional<FrameRange> named_frames() const;
  LogInput input(const std::string& log) const;
};

/// One line for the terminal, whatever the words hold. What libraries call "overwrite it" or "continue with
/// force" is named by the option that does it.
std::string terminal_line(std::string words);

/// Prints terminal_line() on stderr: for all that comes from files.
void print_line(const std::string& words);

/// --track, of a video with several.
void add_track_option(CLI::App& command, int& track);

/// Says on stderr in which unit a mesh file was read that notes none.
void say_mesh_unit(const std::filesystem::path& file);

/// --overwrite, in every command that writes a file or folder.
void add_overwrite_flag(CLI::App& command, bool& overwrite);
/// The one rule for files that a person names to be written; RunFolder's is that for folders. Called before
/// long work. "" is no file. Throws Error when the file's folder does not exist, when the file is there and
/// not to be overwritten, and whenever it is a recording, or not a file.
void check_output_file(const std::filesystem::path& file, bool overwrite);

/// --keep-free, in every command that records.
void add_keep_free_option(CLI::App& command, std::int64_t& bytes);

/// "12-21" or "1280x800": two whole numbers, not negative, and nothing else.
std::optional<std::pair<int, int>> two_numbers(const std::string& text, char between);

/// Checks of option values: "" or the reason for a refusal.
/// A picture's file must end in .png.
std::string refuse_unless_png(const std::string& path);
/// A number, all of it and nothing else: no comma, no unit.
CLI::Validator number_between(double least, double most);
/// For CLI::Option::transform(). CLI11 itself reads 010 as 8, and -1 as the largest number without a sign.
CLI::Validator whole_number(std::int64_t least, std::int64_t most);

}  // namespace gelslam
