#include "study_command.hpp"

#include <iostream>

#include "gelslam/core/error.hpp"
#include "stability_levels.hpp"

namespace gelslam::bench {

void TouchStudyArguments::add_to(CLI::App& app, const std::string& data_help, const std::string& charts_help,
                                 const std::string& quick_help, const std::string& out_help) {
  app.add_option("DATA", data, data_help);
  app.add_option("--methods", methods, "normalflow, icp, fpfh, filterreg; -tuned for their best settings")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--charts", charts, charts_help)
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(stability_charts()));
  app.add_flag("--quick", quick, quick_help);
  app.add_flag("--simulated-only", simulated_only, "without the sequences");
  app.add_option("-o,--output", out, out_help);
}

int run_study(CLI::App& app, int argc, char** argv, const std::function<void()>& study) {
  CLI11_PARSE(app, argc, argv);
  try {
    study();
  } catch (const Error& error) {
    std::cerr << app.get_name() << ": error: " << error.what() << "\n";
    return 2;
  }
  return 0;
}

}  // namespace gelslam::bench
