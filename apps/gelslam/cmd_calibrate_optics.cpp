#include <fmt/core.h>

#include <iostream>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/optics_fit.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/even_sample.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct OpticsArguments {
  LogInput input;
  fs::path output;
  bool overwrite = false, quiet = false;
};

constexpr std::int64_t kWantedFrames = 150;  // Limited, because pairs of frames take memory and time.

/// Returns some of a log's frames with their poses in the largest component of the map.
std::vector<SeenFrame> seen_frames(const LogInput& input, const Config& config, ProgressSink& progress) {
  StageTimer timer;
  SurfaceStream stream(input, config, timer);
  GelSlam slam(config.slam);
  EvenSample<SurfacePtr> kept(2 * kWantedFrames,
                              std::max<std::int64_t>(1, stream.frame_count().value_or(0) / kWantedFrames));
  progress.begin("tracking", stream.frame_count());
  while (const auto item = stream.next()) {
    const std::int64_t frame = item->image.index;
    slam.process(frame, item->image.time_s, item->surface, timer);
    if (item->surface) kept.add(frame, item->surface);
    progress.update(frame + 1);
  }
  progress.end();
  const SlamMap map = slam.finish(/*refine=*/true, &progress);
  const MapSnapshot poses = snapshot_of(map);
  std::vector<SeenFrame> frames;
  for (const FrameRecord& frame : map.frames)
    if (const auto surface = kept.items().find(frame.frame);
        surface != kept.items().end() && map.has_pose(frame))
      frames.push_back({surface->second, poses.pose_of(frame)->map_T_frame.pose});
  return frames;
}

int run_optics(const OpticsArguments& arguments) {
  check_output_file(arguments.output, arguments.overwrite);
  StoppableProgress progress(arguments.quiet);
  const Config config = resolve_config(arguments.input);
  const std::vector<SeenFrame> frames = seen_frames(arguments.input, config, progress);
  progress.begin("fitting optics", std::nullopt);
  const OpticsFit fit = optics_from_motion(frames);
  progress.update(0);  // Throws if it was stopped.
  progress.end();
  const std::string problem = why_impossible(fit.optics, config.sensor.width_px, config.sensor.height_px,
                                             config.surface.pixel_pitch_mm);
  if (!problem.empty()) throw Error(quoted(arguments.input.log) + " shows no sensor's optics: " + problem);
  std::cout << fit.words()
            << fmt::format("{} pairs of frames, whose normals agree within {:.3f} rad\n", fit.measurements,
                           fit.residual);
  if (!arguments.output.empty()) write_optics(arguments.output, fit.optics);
  if (fit.not_shown().empty()) return kExitDone;
  std::cerr << "the log does not show " << fit.not_shown()
            << ": slide a textured thing over the whole gel, turn and tilt it\n";
  return kExitNotGood;
}

}  // namespace

void add_calibrate_optics_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("optics", "Find lens, camera distance and dome of a sensor");
  auto& arguments = options_of(*command, exit_code, run_optics);
  command->add_option("LOG", arguments.input.log, "Log of a textured thing slid over the gel")->required();
  command->add_option("--config", arguments.input.config,
                      "Configuration (default: the log's own, else config.yaml in or beside it)");
  command->add_option("--model", arguments.input.model, "Gradient model (default: the log's own)");
  command->add_option("-o,--output", arguments.output, "optics.yaml to write");
  add_overwrite_flag(*command, arguments.overwrite);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Slide something with texture over the whole gel for twenty seconds, turn and tilt it. Put the result "
      "beside catalog.csv and train again.\n"
      "Exit code 1: the log does not show all numbers; those stay as they were.\n"
      "Example: gelslam calibrate optics slide.mkv --model model.json -o PRESSES/optics.yaml");
}

}  // namespace gelslam
