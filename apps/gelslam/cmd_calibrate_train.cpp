#include <cstdio>
#include <iostream>
#include <memory>

#include "calibrate_commands.hpp"
#include "commands.hpp"
#include "gelslam/calibration/ball_sizes.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/calibration/model_trainer.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/surface/model_file.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct TrainArguments {
  PressOptions presses;
  fs::path output, pth;
  std::uint64_t seed = 1;
  int steps = 0;  // 0: the recipe's
  bool automatic = false, published = false, overwrite = false;
};

void require_labels(const PressSet& set) {
  std::size_t bare = 0;
  std::string first;
  for (const CalibrationPress& press : set.presses) {
    if (press.label || press.left_out || !press.problem.empty()) continue;
    if (bare++ == 0) first = press.name;
  }
  if (bare > 0)
    throw Error("'" + set.folder.string() + "': " + std::to_string(bare) + " of " +
                std::to_string(set.presses.size()) + " presses have no label (first: " + first +
                "); label them or leave them out: gelslam calibrate label " + set.folder.string() +
                "; or give --automatic, which takes every clear contact and names the rest");
}

CalibrationRecord record_of(const PressSet& set, const ModelCheck& check, const TrainArguments& arguments) {
  CalibrationRecord record;
  record.width_px = set.background.cols;
  record.height_px = set.background.rows;
  record.pixel_pitch_mm = arguments.presses.pitch_mm;
  record.presses = static_cast<int>(check.presses.size());
  for (const DiameterCheck& ball : check.diameters) record.diameters_mm.push_back(ball.diameter_mm);
  record.seed = arguments.seed;
  record.background_cells = background_cells(set.background);
  return record;
}

void write_model(const fs::path& path, const GradientModel& model, const CalibrationRecord& record) {
  if (path.extension() == ".pth")
    write_pth_model(path, model);
  else
    write_model_file(path, {model, record});
}

int run_train(TrainArguments arguments) {
  refuse_to_replace_file(arguments.output, arguments.overwrite);
  if (!arguments.pth.empty()) refuse_to_replace_file(arguments.pth, arguments.overwrite);
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.presses.quiet);
  const PressSet set = read_presses(arguments.presses);
  if (!arguments.automatic) require_labels(set);
  const BallZones zones =
      find_zones_for_people(set, arguments.presses, arguments.automatic, *progress, interrupt);
  require_good_coverage(set, zones);
  const std::string contradiction =
      contradiction_between_sizes(compare_ball_sizes(set, zones.zones, arguments.presses.pitch_mm));
  if (!contradiction.empty()) throw Error("'" + set.folder.string() + "': " + contradiction);
  ModelTraining training{arguments.presses.pitch_mm, arguments.seed, {}};
  if (arguments.published) training.recipe = published_recipe();
  if (arguments.steps > 0) training.recipe.steps = arguments.steps;
  const auto stop = [&] { return interrupt.requested(); };
  GradientModel model = train_model(set, zones.zones, training, *progress, stop);
  model.sigma_rad = held_out_sigma_rad(set, zones.zones, training, *progress, stop);
  progress->begin("checking", static_cast<std::int64_t>(zones.zones.size()));
  const ModelCheck check =
      check_model(model, set, zones.zones, arguments.presses.pitch_mm, [&](std::size_t done) {
        stop_if_asked(interrupt);
        progress->update(static_cast<std::int64_t>(done));
      });
  progress->end();
  const CalibrationRecord record = record_of(set, check, arguments);
  write_model(arguments.output, model, record);
  if (!arguments.pth.empty()) write_pth_model(arguments.pth, model);
  std::printf("trained on %zu presses; on these: slope error %.2f degrees, gain x %.3f y %.3f",
              check.presses.size(), check.errors.all.mean_abs_error_deg(), check.gains.all.gain_x(),
              check.gains.all.gain_y());
  for (const DiameterCheck& ball : check.diameters)
    std::printf(", %.2f mm ball %+.1f %%", ball.diameter_mm, 100.0 * ball.radius_error());
  std::printf("\n");
  if (check.diameters.size() == 1)
    std::cerr
        << "note: presses of one ball cannot show whether its diameter is right: press a second size too, "
           "or check these presses with a model that you trust (gelslam calibrate check)\n";
  for (const std::string& reason : check.reasons) std::cerr << "note: " << reason << "\n";
  return check.verdict == Verdict::recalibrate ? exit_not_good : exit_done;
}

}  // namespace

void add_calibrate_train_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("train", "Train a model on labeled presses");
  const auto arguments = std::make_shared<TrainArguments>();
  arguments->presses.add_to(*command);
  command
      ->add_option("-o,--output", arguments->output,
                   "Model to write: PyTorch format if it ends in .pth, else GelSLAM's own")
      ->required();
  command->add_option("--pth", arguments->pth, "Also write the model in PyTorch format (nnmodel.pth)");
  command->add_option("--seed", arguments->seed, "Seed of all random numbers")->capture_default_str();
  command
      ->add_option("--steps", arguments->steps,
                   "Training steps (default 12000, about 30 s; fewer: quicker, worse)")
      ->check(CLI::Range(1, 1'000'000));
  command->add_flag("--automatic", arguments->automatic,
                    "Label presses that have no label, for this run only");
  command->add_flag("--published", arguments->published, "The published recipe instead of ours, to compare");
  command->add_flag("--overwrite", arguments->overwrite, "Replace a model that is there");
  command->footer(
      "The same presses and seed give the same model. Exit code 1 when the model is written but poor.\n"
      "Example: gelslam calibrate train PRESSES -o model.json --pth nnmodel.pth");
  command->callback([arguments, &exit_code] { exit_code = run_train(*arguments); });
}

}  // namespace gelslam
