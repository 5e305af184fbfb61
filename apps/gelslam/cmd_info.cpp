#include <filesystem>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "gelslam/sensor/frame_source.hpp"

namespace gelslam {
namespace {

struct InfoArguments {
  std::filesystem::path path;
};

void run_info(const InfoArguments& arguments) {
  std::cout << open_frame_source(arguments.path, SensorProfile{})->description() << "\n";
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("info", "Say what is in a log, a data folder, a model, a config or a run folder");
  const auto arguments = std::make_shared<InfoArguments>();
  command->add_option("PATH", arguments->path, "video, folder, nnmodel.pth or config.yaml")->required();
  command->footer("Example: gelslam info RUN --json");
  command->callback([arguments, &exit_code] {
    run_info(*arguments);
    exit_code = exit_done;
  });
}

}  // namespace gelslam
