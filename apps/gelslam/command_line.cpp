#include "command_line.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <iostream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/raw_log.hpp"

namespace gelslam {
namespace {

/// Converts "1.5GB" to "1500000000".
std::string bytes_of_size(std::string& text) {
  constexpr std::pair<std::string_view, double> units[] = {{"", 1},     {"b", 1},    {"kb", 1e3},
                                                           {"mb", 1e6}, {"gb", 1e9}, {"tb", 1e12}};
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, code] = std::from_chars(text.data(), end, number);
  for (const auto& [unit, bytes] : units) {
    if (code != std::errc() || lower_case({rest, end}) != unit) continue;
    if (!(number >= 0 && number * bytes <= 1e15)) break;
    text = std::to_string(static_cast<std::int64_t>(number * bytes));
    return "";
  }
  return text + " is no size: give a number and its unit (B, kB, MB, GB or TB), as 1.5GB";
}

/// Rewrites an integer so that CLI11 reads it correctly.
template <typename Number>
CLI::Validator within(Number least, Number most, const char* kind, const std::string& range) {
  const auto check = [least, most, kind, range](std::string& text) -> std::string {
    Number value = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, code] = std::from_chars(text.data(), end, value);
    if (code != std::errc() || rest != end || !(value >= least && value <= most))
      return text + " is no " + kind + " from " + range +
             (rest != end && *rest == ',' ? " (write a point, not a comma)" : "");
    if constexpr (std::is_integral_v<Number>) text = std::to_string(value);
    return "";
  };
  return CLI::Validator(check, range);
}

}  // namespace

void LogOptions::add_to(CLI::App& command) {
  command.add_option("--config", config,
                     "Configuration (default: the log's own, else config.yaml in or beside it)");
  command.add_option(
      "--model", model,
      "Gradient model nnmodel.pth (default: the log's own, or the one the configuration names)");
  CLI::Option* image =
      command.add_option("--background", background,
                         "Image of the bare gel (default: the mean of the first frames that show it)");
  command
      .add_option("--background-frames", background_frames,
                  "Frames of the log that show the bare gel, as 12-21, from 0; earlier ones are left out")
      ->excludes(image);
  command.add_flag("--force", force, "Continue although the first frames seem to show contact");
  command
      .add_option(
          "--time", time,
          "Times of poses: Unix time, where the log knows it (clock), or since its first frame (start)")
      ->check(CLI::IsMember({"clock", "start"}))
      ->capture_default_str();
  add_track_option(command, track);
}

void add_track_option(CLI::App& command, int& track) {
  command.add_option("--track", track, "Video track of a file with several, from 1")
      ->transform(whole_number(1, 99));
}

LogInput LogOptions::input(const std::string& log) const {
  return {.log = log,
          .config = config,
          .model = model,
          .background = background,
          .force = force,
          .background_frames = named_frames(),
          .counts_from_start = time == "start",
          .track = track};
}

std::optional<FrameRange> LogOptions::named_frames() const {
  if (background_frames.empty()) return std::nullopt;
  constexpr int most = 10000;  // All frames are held in memory at once.
  const auto range = two_numbers(background_frames, '-');
  if (!range || range->second < range->first || range->second - range->first >= most)
    throw Error("--background-frames " + background_frames +
                ": give the first and the last frame, as 12-21 (at most 10000)");
  return FrameRange{range->first, range->second};
}

std::optional<std::pair<int, int>> two_numbers(const std::string& text, char between) {
  std::pair<int, int> numbers;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, numbers.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != between) return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, numbers.second);
  const bool is_whole = second.ec == std::errc() && second.ptr == end;
  return is_whole && std::min(numbers.first, numbers.second) >= 0 ? std::optional(numbers) : std::nullopt;
}

std::string terminal_line(std::string words) {
  for (const auto& [phrase, option] :
       {std::pair("overwrite it", "give --overwrite"),
        {"continue with force", "give --force"},
        {"(force continues", "(--force continues"},
        {"name background frames", "name --background-frames"},
        {"name a background picture", "name a picture of the bare gel by --background"},
        {"or a background picture", "or a --background picture"}})
    if (const std::size_t at = words.find(phrase); at != std::string::npos)
      words.replace(at, std::strlen(phrase), option);
  return one_line(words);
}

void print_line(const std::string& words) { std::cerr << terminal_line(words) << std::endl; }

void say_mesh_unit(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return;
  if (const auto bytes = static_cast<std::int64_t>(bytes_behind_mesh(file)); bytes > 0)
    print_line(file.string() + ": ignored " + counted(bytes, "byte") + " behind the last triangle");
  if (!noted_unit(file)) print_line("unit of " + file.string() + ": " + short_name(usual_unit(file)));
}

void add_overwrite_flag(CLI::App& command, bool& overwrite) {
  command.add_flag("--overwrite", overwrite, "Replace what is there");
}

void add_keep_free_option(CLI::App& command, std::int64_t& bytes) {
  bytes = 1'000'000'000;
  command.add_option("--keep-free", bytes, "Room to leave on the disk: the recording ends before, whole")
      ->transform(CLI::Validator(bytes_of_size, "SIZE"))
      ->default_str("1GB");
}

void check_output_file(const std::filesystem::path& file, bool overwrite) {
  namespace fs = std::filesystem;
  const fs::path folder = file.parent_path();
  if (!folder.empty() && !fs::is_directory(folder))
    throw Error("there is no folder " + quoted(folder) + " to write " + quoted(file.filename()) + " into");
  // For example /dev/stdout.
  if (file.empty() || !fs::exists(file) || fs::is_other(fs::status(file))) return;
  if (fs::is_directory(file)) throw Error(quoted(file) + " is a folder; name a file");
  if (is_matroska(file) || file.filename() == "session.db")
    throw Error(quoted(file) + " is a recording, which cannot be made again; choose another name");
  if (!overwrite) throw Error(quoted(file) + " is already there; choose another name, or give --overwrite");
}

std::string refuse_unless_png(const std::string& path) {
  if (lower_case(std::filesystem::path(path).extension().string()) == ".png") return "";
  return path + ": pictures are written as PNG; give a name that ends in .png";
}

CLI::Validator number_between(double least, double most) {
  return within(least, most, "number", fmt::format("{:.10g} to {:.10g}", least, most));
}

CLI::Validator whole_number(std::int64_t least, std::int64_t most) {
  return within(least, most, "whole number", fmt::format("{} to {}", least, most));
}

}  // namespace gelslam
