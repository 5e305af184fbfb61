#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "gelslam/slam/surface_stream.hpp"

namespace gelslam {

/// The options by which every command that reads a log finds its configuration, model and background.
struct LogOptions {
  std::string log, config, model, background;
  bool force = false;

  void add_to(CLI::App& command);
  LogInput input() const { return {log, config, model, background, force}; }
};

}  // namespace gelslam
