#include <filesystem>
#include <memory>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct RecordArguments {
  std::string output, device, from, config, model;
  double seconds = 0;
  std::int64_t keep_free_bytes = 0;
  int track = 0;
  bool resized = false, quiet = false;
};

CameraInput open_log(const RecordArguments& arguments, const Config& config) {
  CameraInput log;
  log.attachments = attachments_of(config);
  log.frames = open_raw_log(arguments.from, config.sensor);
  const LogAttachments old =
      is_matroska(arguments.from) ? read_log_attachments(arguments.from) : LogAttachments{};
  log.attachments.sensor = old.sensor.empty() ? log.frames->description() : old.sensor;
  log.attachments.camera_settings = old.camera_settings;
  return log;
}

void record_all(const RecordArguments& arguments, const Config& config, RawFrameSource& source,
                LogRecorder& recorder, RecordReport& report) {
  StartCheck check(config, [&](const std::string& doubt) { report.say("doubt: " + doubt); });
  const bool can_wait = !arguments.from.empty();
  const InterruptStopper stopper(can_wait ? InterruptWatch::Ends::early : InterruptWatch::Ends::regularly,
                                 [&] { source.stop(); });
  while (std::optional<RawFrame> next = source.next()) {
    if (stopper.requested() || (arguments.seconds > 0 && next->time_s >= arguments.seconds)) return;
    check.look_at(*next);
    LogRecorderStatus status = recorder.status();
    if (can_wait && !status.stopped) status.warning.clear();  // a log waits for the disk, as long as it takes
    report.count(*next, status);
    auto frame = std::make_shared<const RawFrame>(std::move(*next));
    if (can_wait)
      recorder.push_waiting(std::move(frame));
    else
      recorder.push(std::move(frame));
    if (recorder.status().stopped) return;
  }
}

int run_record(const RecordArguments& arguments) {
  const fs::path log =
      arguments.output.empty() ? fs::path(name_by_time() + ".mkv") : fs::path(arguments.output);
  std::error_code code;
  if (fs::exists(log, code))
    throw Error(log.string() + ": exists already; name another file");  // before a camera is disturbed
  const Config config = find_config({.log = arguments.from,
                                     .config = arguments.config,
                                     .model = arguments.model,
                                     .track = arguments.track});
  const CameraInput source = arguments.from.empty() ? open_camera_input(config, arguments.device, kAwayS)
                                                    : open_log(arguments, config);
  LogRecorderOptions options;
  if (!arguments.from.empty())
    options.max_waiting_bytes = 32u << 20;  // a whole log need not pile up in memory
  options.keep_free_bytes = arguments.keep_free_bytes;
  if (arguments.resized) options.resize_to = config.sensor;
  LogRecorder recorder(std::make_unique<LogWriter>(log, source.attachments, source.frames->rate_hz()),
                       options);
  RecordReport report(log.string(), arguments.quiet, *source.frames);
  report.start();
  std::exception_ptr failure;
  try {
    record_all(arguments, config, *source.frames, recorder, report);
  } catch (const Error&) {
    failure = std::current_exception();
  }
  recorder.finish();
  report.finish(recorder.status());
  if (failure) std::rethrow_exception(failure);
  return report.good() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_record_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "record", "Record a sensor into a log that can be reconstructed, replayed and shared");
  auto& arguments = options_of(*command, exit_code, run_record);
  command->add_option("-o,--output", arguments.output, "Log to write (default: gelslam-DATE-TIME.mkv here)");
  auto* device =
      command->add_option("--camera", arguments.device,
                          "Camera: a path, a number or part of its name (default: the configuration's, else "
                          "the one that looks like the sensor)");
  command
      ->add_option("--from", arguments.from, "Another log instead of a camera: converts videos and folders")
      ->excludes(device);
  command->add_option("--seconds", arguments.seconds, "Stop after this many seconds (default: at Ctrl-C)")
      ->check(number_between(0.01, 1e6));
  command->add_flag(
      "--resized", arguments.resized,
      "Store the resized pictures that tracking uses, without loss (PNG), instead of the camera's own");
  command->add_option("--config", arguments.config, "Configuration to use and to store in the log");
  command->add_option("--model", arguments.model, "Gradient model nnmodel.pth to store in the log");
  add_track_option(*command, arguments.track);
  add_keep_free_option(*command, arguments.keep_free_bytes);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Example: gelslam record --model nnmodel.pth --seconds 60 -o scan.mkv\n"
      "Exit code 1: nothing was recorded, or not all (disk full or too slow).");
}

}  // namespace gelslam
