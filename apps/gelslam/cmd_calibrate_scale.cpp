#include <fmt/core.h>

#include <Eigen/LU>
#include <iostream>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/slope_matrix.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct ScaleArguments {
  LogInput input;
  fs::path output;
  double diameter_mm = 0;
  bool overwrite = false, quiet = false;
};

/// Returns the largest contact of each second.
std::vector<SurfacePtr> largest_touches(const LogInput& input, const Config& config, ProgressSink& progress) {
  StageTimer timer;
  SurfaceStream stream(input, config, timer);
  std::vector<SurfacePtr> touches;
  std::int64_t second = -1;
  progress.begin("reading touches", stream.frame_count());
  while (const auto item = stream.next()) {
    progress.update(item->image.index + 1);
    if (!item->surface || item->surface->contact_mm2() < config.slam.tracker.min_contact_mm2) continue;
    if (const auto now = static_cast<std::int64_t>(item->image.time_s); now != second) {
      touches.push_back(item->surface);
      second = now;
    } else if (item->surface->contact_pixels > touches.back()->contact_pixels) {
      touches.back() = item->surface;
    }
  }
  progress.end();
  return touches;
}

GradientModel corrected(GradientModel model, const Eigen::Matrix2d& read_over_true) {
  using RowMajor = Eigen::Matrix<float, 2, 2, Eigen::RowMajor>;
  Eigen::Map<RowMajor> matrix(model.slope_matrix.data());
  matrix = RowMajor(read_over_true.inverse().cast<float>() * matrix);
  return model;
}

int run_scale(const ScaleArguments& arguments) {
  check_output_file(arguments.output, arguments.overwrite);
  StoppableProgress progress(arguments.quiet);
  const Config config = resolve_config(arguments.input);
  const SlopeMatrix found =
      slope_matrix_from_ball(largest_touches(arguments.input, config, progress), arguments.diameter_mm);
  const auto &s = found.read_over_true, &e = found.sigma;
  fmt::print(
      "read over true slopes of {}, with standard deviations:\n"
      "  along x {:.2f} +- {:.2f}, of it along y {:+.2f} +- {:.2f}\n"
      "  along y {:.2f} +- {:.2f}, of it along x {:+.2f} +- {:.2f}\n",
      counted(found.touches, "press"), s(0, 0), e(0, 0), s(1, 0), e(1, 0), s(1, 1), e(1, 1), s(0, 1),
      e(0, 1));
  const bool corrects = found.needs_correction();
  if (!corrects) std::cout << "the model needs no correction\n";
  ModelFile file{read_gradient_model(config.sensor.calibration_model_path), {}};
  if (corrects) file.model = corrected(std::move(file.model), s);
  write_model_file(arguments.output, file);
  return kExitDone;
}

}  // namespace

void add_calibrate_scale_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command =
      calibrate.add_subcommand("scale", "Correct the slopes of another sensor's model by presses of a ball");
  auto& arguments = options_of(*command, exit_code, run_scale);
  command->add_option("LOG", arguments.input.log, "Log in which a ball is pressed in, at several places")
      ->required();
  command->add_option("--diameter", arguments.diameter_mm, "Of the ball, mm")
      ->required()
      ->check(CLI::Range(0.5, 100.0));
  command->add_option("--config", arguments.input.config,
                      "Configuration (default: the log's own, else config.yaml in or beside it)");
  command->add_option("--model", arguments.input.model, "Gradient model (default: the log's own)");
  command->add_option("-o,--output", arguments.output, "Corrected model to write (JSON)")->required();
  add_overwrite_flag(*command, arguments.overwrite);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Takes a minute: record with nothing on the gel, then press any ball of known diameter in at ten "
      "places. Presses differ by 0.15, so that one alone tells little. A model of the sensor itself "
      "(calibrate train) is better.\n"
      "Example: gelslam calibrate scale ball.mkv --model nnmini.pt --diameter 6 -o model.json");
}

}  // namespace gelslam
