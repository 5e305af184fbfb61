// Study: what the tracker makes of pictures that are disturbed: the pictures of a data folder with truth,
// changed in one way after the other.
#include <algorithm>
#include <memory>
#include <vector>

#include "disturbed_log.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "judgement.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

struct DisturbancesArguments {
  std::filesystem::path folder, model, out;
};

/// Tracks the disturbed log; poses are compared within their trial.
Json track(const DisturbancesArguments& arguments, const GroundTruth& truth, const Disturbance& disturbance) {
  const LogInput input{.log = arguments.folder, .config = {}, .model = arguments.model, .background = {}};
  const Config config = resolve_config(input);
  StageTimer timer;
  auto log =
      std::make_shared<DisturbedLog>(open_frame_source(input.log, config.sensor), truth.background_frames,
                                     static_cast<std::int64_t>(truth.start_T_currs.size()), disturbance);
  SurfaceStream stream(decode_frames(std::move(log), input.log.string(), config.sensor), input, config, timer,
                       {});
  Tracker tracker(config.slam.tracker, config.slam.registration, config.slam.verification);
  Tally tally;
  int trial = -1;
  double worst_mm = 0, worst_deg = 0;
  Pose start_T_trial = Pose::Identity();
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    if (!item->surface) continue;
    const TrackedFrame tracked = tracker.track(item->frame, item->time_s, item->surface);
    const auto& pose =
        truth.start_T_currs.at(static_cast<std::size_t>(item->frame - truth.background_frames));
    if (tracked.status != TrackStatus::tracked || !pose) continue;
    if (tracked.trial != trial) {
      trial = tracked.trial;
      start_T_trial = *pose * tracked.trial_T_frame.inverse();
    }
    const Judgement judged =
        judge_pose_error(tracked.trial_T_frame.inverse(), pose->inverse() * start_T_trial,
                         tracked.registration.observable, true);
    tally.add(judged);
    worst_mm = std::max(worst_mm, judged.error_mm);
    worst_deg = std::max(worst_deg, judged.error_deg);
  }
  const auto touched = std::count_if(truth.start_T_currs.begin(), truth.start_T_currs.end(),
                                     [](const auto& pose) { return pose.has_value(); });
  return {{"disturbance", disturbance.name},
          {"touched", touched},
          {"tracked", tally.tracked},
          {"trials", trial + 1},
          {"worst_mm", worst_mm},
          {"worst_deg", worst_deg},
          {"wrong", tally.silent}};
}

void run(const DisturbancesArguments& arguments) {
  const GroundTruth truth = read_ground_truth(arguments.folder);
  Json rows = Json::array();
  constexpr Disturbance kNone{"none", [](Picture&) {}};
  std::vector<Disturbance> all{kNone};
  all.insert(all.end(), disturbances().begin(), disturbances().end());
  StudyCases cases(all.size());
  for (const Disturbance& disturbance : all) {
    cases.begin(disturbance.name);
    rows.push_back(track(arguments, truth, disturbance));
    write_study(arguments.out, "disturbances", rows);
  }
  print_table(rows);
}

}  // namespace

void add_disturbances(CLI::App& lab) {
  const auto arguments = std::make_shared<DisturbancesArguments>();
  CLI::App* command =
      add_study(lab, "disturbances",
                "Track the pictures of a data folder, disturbed in one way after the other", arguments, run);
  command->add_option("DATA", arguments->folder, "Data folder with true_start_T_currs.npy")->required();
  command->add_option("--model", arguments->model, "Gradient model (default: the one that the folder names)");
  command->add_option("-o,--output", arguments->out, "Folder for disturbances.csv and disturbances.json");
  command->footer("Example: gelslam-lab disturbances DATA/sequences/track_golf");
}

}  // namespace gelslam::lab
