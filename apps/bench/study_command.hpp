#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace gelslam::bench {

/// What the studies of several methods on generated and recorded touches take on the command line.
struct TouchStudyArguments {
  std::vector<std::filesystem::path> data;
  std::vector<std::string> methods = {"normalflow",      "icp", "icp-tuned", "filterreg",
                                      "filterreg-tuned", "fpfh"};
  std::vector<std::string> charts;  ///< empty: all
  bool quick = false, simulated_only = false;
  std::filesystem::path out;

  void add_to(CLI::App& app, const std::string& data_help, const std::string& charts_help,
              const std::string& quick_help, const std::string& out_help);
};

/// Parses, runs the study, and says of a mistake what it was. Returns the program's exit code.
int run_study(CLI::App& app, int argc, char** argv, const std::function<void()>& study);

}  // namespace gelslam::bench
