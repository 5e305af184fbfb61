#include <filesystem>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "info_report.hpp"

namespace gelslam {
namespace {

struct InfoArguments {
  std::filesystem::path path;
  bool json = false;
};

int run_info(const InfoArguments& arguments) {
  const InfoReport report = inspect(arguments.path);
  std::cout << (arguments.json ? report.json() : report.text());
  return report.has_problems() ? exit_not_good : exit_done;
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("info", "Say what is in a log, a data folder, a run, a model, a config or a mesh");
  const auto arguments = std::make_shared<InfoArguments>();
  command->add_option("PATH", arguments->path, "video, folder, nnmodel.pth, config.yaml, mesh or .npy")
      ->required();
  command->add_flag("--json", arguments->json, "one JSON object for another program");
  command->footer(
      "Example: gelslam info RUN --json\nExit code 1: what was found has a problem, which is said.");
  command->callback([arguments, &exit_code] { exit_code = run_info(*arguments); });
}

}  // namespace gelslam
