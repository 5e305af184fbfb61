#include <fmt/core.h>

#include <iostream>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/calibrate.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct TrainArguments {
  PressOptions presses;
  fs::path output, pth;
  int steps = ModelTraining{}.steps;
  bool automatic = false, overwrite = false;
};

int run_train(TrainArguments& arguments) {
  check_output_file(arguments.output, arguments.overwrite);
  check_output_file(arguments.pth, arguments.overwrite);
  StoppableProgress progress(arguments.presses.quiet);
  const PressSet set = read_presses(arguments.presses);
  const Calibration calibration = calibrate(
      set, {.pixel_pitch_mm = arguments.presses.pitch_mm, .steps = arguments.steps}, arguments.automatic,
      progress, [](const std::string& press) { print_line("left out: " + press); });
  const ModelCheck& check = calibration.check;
  const bool is_pth = arguments.output.extension() == ".pth";
  is_pth ? write_pth_model(arguments.output, calibration.file.model)
         : write_model_file(arguments.output, calibration.file);
  if (!arguments.pth.empty()) write_pth_model(arguments.pth, calibration.file.model);
  fmt::print(
      "trained on {} presses; models of half of them read the other half with: slope error {:.2f} degrees, "
      "gradient scale x {:.3f} y {:.3f}",
      check.presses.size(), check.slopes.all.mean_abs_error_deg(), check.slopes.all.scale_x(),
      check.slopes.all.scale_y());
  for (const DiameterCheck& ball : check.diameters)
    fmt::print(", {:.2f} mm ball {:+.1f} %", ball.diameter_mm, 100.0 * ball.radius_error());
  fmt::print("\n");
  if (!fs::exists(set.folder / kOpticsFileName))
    std::cerr << "note: no " << kOpticsFileName << " beside the presses: trained for "
              << optics_text(*set.optics) << " (gelslam calibrate optics finds your sensor's)\n";
  if (is_pth)
    print_line(
        "note: PyTorch's format holds neither optics nor uncertainty: also write GelSLAM's own (-o "
        "model.json --pth " +
        arguments.output.filename().string() + ")");
  if (check.diameters.size() == 1)
    std::cerr
        << "note: presses of one ball cannot show whether its diameter is right: press a second size too, "
           "or check these presses with a model that you trust (gelslam calibrate check)\n";
  for (const std::string& reason : check.reasons) std::cerr << "note: " << reason << "\n";
  return check.verdict == Verdict::recalibrate ? kExitNotGood : kExitDone;
}

}  // namespace

void add_calibrate_train_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("train", "Train a model on labeled presses");
  auto& arguments = options_of(*command, exit_code, run_train);
  arguments.presses.add_to(*command);
  command
      ->add_option("-o,--output", arguments.output,
                   "Model to write: PyTorch format if it ends in .pth, else GelSLAM's own")
      ->required();
  command->add_option("--pth", arguments.pth, "Also write the model in PyTorch format (nnmodel.pth)");
  command
      ->add_option("--steps", arguments.steps,
                   "Training steps (default 36000, about 90 s; fewer: quicker, worse)")
      ->transform(whole_number(1, 1'000'000));
  command->add_flag("--automatic", arguments.automatic,
                    "Label presses that have no label, for this run only");
  add_overwrite_flag(*command, arguments.overwrite);
  command->footer(
      "The same presses give the same model. Exit code 1 when the model is written but poor.\n"
      "Example: gelslam calibrate train PRESSES -o model.json --pth nnmodel.pth");
}

}  // namespace gelslam
