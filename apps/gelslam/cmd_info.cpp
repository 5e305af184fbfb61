#include <fmt/ranges.h>
#include <unistd.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "gelslam/core/text.hpp"
#include "info_report.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

std::string info_text(const InfoReport& report) {
  std::string text = one_line(report.path.string()) + ": " + report.kind + "\n";
  const auto line = [&](const std::string& key, const std::string& words) {
    text += fmt::format("  {:<11}{}\n", key, words);
  };
  for (const auto& [key, words] : report.facts) line(key, one_line(words));
  for (const std::string& warning : report.warnings) line("warning", amber(one_line(warning), STDOUT_FILENO));
  for (const std::string& problem : report.problems) line("problem", one_line(problem));
  if (!report.commands.empty()) line("use", fmt::format("gelslam {}", fmt::join(report.commands, ", ")));
  return text;
}

std::string info_json(const InfoReport& report) {
  using Json = nlohmann::ordered_json;
  Json object{{"path", report.path.string()}, {"kind", report.kind}};
  for (const auto& [key, words] : report.facts) object[key] = words;
  object["warnings"] = report.warnings;
  object["problems"] = report.problems;
  object["use"] = report.commands;
  // File names may be of any bytes; what is not UTF-8 is replaced instead of refused.
  return object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

struct InfoArguments {
  std::filesystem::path path;
  int track = 0;
  bool json = false, quiet = false;
};

int run_info(const InfoArguments& arguments) {
  const InfoReport report = inspect(arguments.path, arguments.track, *make_progress(arguments.quiet));
  std::cout << (arguments.json ? info_json(report) : info_text(report));
  return report.problems.empty() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("info", "Say what a file or folder is, whether it is whole, and what takes it");
  auto& arguments = options_of(*command, exit_code, run_info);
  command
      ->add_option("PATH", arguments.path,
                   "Log, video, folder of images, data folder, run, session, trajectory, surface folder, "
                   "calibration presses, model, configuration or mesh")
      ->required();
  command->add_flag("--json", arguments.json, "Print one JSON object for another program");
  add_track_option(*command, arguments.track);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Example: gelslam info RUN --json\nExit code 1: something is wrong with it; the output says what.");
}

}  // namespace gelslam
