#include "log_options.hpp"

namespace gelslam {

void LogOptions::add_to(CLI::App& command) {
  command
      .add_option("LOG", log,
                  "Recorded log, video, folder of images, or data folder (config.yaml, gelsight.avi)")
      ->required();
  command.add_option("--config", config,
                     "Configuration (default: the log's own, else config.yaml in or beside it)");
  command.add_option(
      "--model", model,
      "Gradient model nnmodel.pth (default: the log's own, or the one the configuration names)");
  command.add_option("--background", background,
                     "Image of the bare gel (default: the mean of the log's first frames)");
  command.add_flag("--force", force, "Go on although the log's first frames seem to show contact");
}

}  // namespace gelslam
