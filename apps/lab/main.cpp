#include <exception>
#include <iostream>
#include <opencv2/core/utility.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "studies/study.hpp"

namespace gelslam::lab {
namespace {

int run(int argc, char** argv) {
  CLI::App lab{"Studies and benchmarks of GelSLAM: every chart and table of docs/ comes from here."};
  lab.name("gelslam-lab");
  lab.set_version_flag("--version", "gelslam-lab " GELSLAM_VERSION);
  lab.require_subcommand(1);
  add_ablation(lab);
  add_benchmark(lab);
  add_contact(lab);
  add_speed_accuracy(lab);
  add_stability(lab);
  add_long_scan(lab);
  add_localize(lab);
  add_soak(lab);
  add_micro_benchmarks(lab);
  // Added after the subcommands, which would otherwise inherit it.
  lab.footer(
      "Example: gelslam-lab stability DATA/sequences/track_* -o STUDY && scripts/plot_stability.py STUDY\n"
      "All charts: scripts/results.sh DATA");
  try {
    lab.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {  // A study that is finished, but without a good result.
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return lab.exit(error);
    throw Error(one_line(error.what()) + " (see gelslam-lab --help)");
  }
  return 0;
}

}  // namespace
}  // namespace gelslam::lab

int main(int argc, char** argv) {
  cv::setNumThreads(1);  // Images are small, and the program's own threads do the work.
  try {
    return gelslam::lab::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "gelslam-lab: error: " << gelslam::one_line(error.what()) << std::endl;
    return 2;
  }
}
