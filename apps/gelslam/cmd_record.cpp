#include <algorithm>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>

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
  std::string output;
  std::vector<std::string> devices, from, configs, models;  // of each sensor
  double seconds = 0;
  bool resized = false, quiet = false;
};

/// Where frames come from, and what is known about it.
struct RecordSource {
  Config config;
  std::unique_ptr<RawFrameSource> frames;
  LogAttachments attachments{};
};

/// The logs, or the cameras ("": the configuration's).
std::vector<std::string> sensors_of(const RecordArguments& arguments) {
  std::vector<std::string> sensors;
  for (const std::string& log : arguments.from)
    for (const fs::path& sensor : sensors_of_log(log)) sensors.push_back(sensor.string());
  if (arguments.from.empty()) sensors = arguments.devices;
  if (sensors.empty()) sensors.emplace_back();
  if (sensors.size() > 2) throw Error("a log takes two sensors, not " + std::to_string(sensors.size()));
  std::error_code code;
  if (!arguments.from.empty() && sensors.size() > 1)
    if (sensors[0] == sensors[1] || fs::equivalent(sensors[0], sensors[1], code))
      throw Error(sensors[1] + ": is given twice; a log takes two different sensors");
  return sensors;
}

RecordSource open_log(const std::string& name, const Config& config) {
  RecordSource source{config, nullptr};
  source.attachments = attachments_of(source.config);
  source.frames = open_raw_log(name, source.config.sensor);
  const LogAttachments old = is_matroska(name) ? read_log_attachments(name) : LogAttachments{};
  source.attachments.sensor = old.sensor.empty() ? source.frames->description() : old.sensor;
  source.attachments.camera_settings = old.camera_settings;
  return source;
}

std::vector<RecordSource> open_sources(const RecordArguments& arguments) {
  const std::vector<std::string> names = sensors_of(arguments);
  std::vector<Config> configs;
  for (std::size_t i = 0; i < names.size(); ++i) {
    LogInput input;
    if (!arguments.from.empty()) input.log = names[i];
    input.config = given_for_sensor(arguments.configs, i, names.size(), "--config");
    input.model = given_for_sensor(arguments.models, i, names.size(), "--model");
    configs.push_back(find_config(input));
  }
  std::vector<CameraInput> cameras;
  if (arguments.from.empty()) cameras = open_camera_inputs(configs, names);
  std::vector<RecordSource> sources;
  for (std::size_t i = 0; i < names.size(); ++i)
    sources.push_back(cameras.empty() ? open_log(names[i], configs[i])
                                      : RecordSource{configs[i], std::move(cameras[i].frames),
                                                     std::move(cameras[i].attachments)});
  return sources;
}

/// All frames of all sources. False when one ended early while another went on.
bool record_all(const RecordArguments& arguments, const std::vector<RecordSource>& sources,
                const std::vector<RawFrameSource*>& frames, LogRecorder& recorder, RecordReport& report) {
  std::mutex reporting;  // two cameras have a thread each
  const auto say = [&](const std::string& sentence) {
    const std::lock_guard lock(reporting);
    report.say(sentence);
  };
  std::deque<StartCheck> checks;
  for (const RecordSource& source : sources)
    checks.emplace_back(source.config, [&](const std::string& doubt) {
      say("doubt: " + (sources.size() > 1 ? source.attachments.sensor + ": " : "") + doubt);
    });
  const bool can_wait = !arguments.from.empty();
  bool is_whole = true;
  const InterruptStopper stopper(can_wait ? InterruptWatch::Ends::early : InterruptWatch::Ends::regularly,
                                 [&] { std::ranges::for_each(frames, &RawFrameSource::stop); });
  const auto look = [&](std::size_t sensor, const RawFrame& frame) {
    if (stopper.requested() || (arguments.seconds > 0 && frame.time_s >= arguments.seconds)) return false;
    checks[sensor].look_at(frame);
    LogRecorderStatus status = recorder.status();
    if (can_wait && !status.stopped) status.warning.clear();  // a log waits for the disk, as long as it takes
    const std::lock_guard lock(reporting);
    report.count(frame, status);
    return true;
  };
  const auto lost = [&](const std::string& why) {
    is_whole = false;
    say("warning: " + why + "; the other sensor goes on");
  };
  record_sensors(frames, recorder, {can_wait, look, lost});
  return is_whole;
}

int run(const RecordArguments& arguments) {
  const fs::path log =
      arguments.output.empty() ? fs::path(name_by_time() + ".mkv") : fs::path(arguments.output);
  std::error_code code;
  if (fs::exists(log, code))
    throw Error(log.string() + ": exists already; name another file");  // before a camera is disturbed
  const std::vector<RecordSource> sources = open_sources(arguments);
  LogRecorderOptions options;
  if (!arguments.from.empty())
    options.max_waiting_bytes = 32u << 20;  // a whole log need not pile up in memory
  std::vector<LogTrack> tracks;
  std::vector<RawFrameSource*> frames;
  for (const RecordSource& source : sources) {
    tracks.push_back({source.attachments, source.frames->rate_hz()});
    frames.push_back(source.frames.get());
    if (arguments.resized) options.resize_to.push_back(source.config.sensor);
  }
  LogRecorder recorder(std::make_unique<LogWriter>(log, tracks), options);
  RecordReport report(log.string(), arguments.quiet, frames);
  report.start();
  bool is_whole = false;
  std::exception_ptr failure;
  try {
    is_whole = record_all(arguments, sources, frames, recorder, report);
  } catch (const Error&) {
    failure = std::current_exception();
  }
  recorder.finish();
  report.finish(recorder.status());
  if (failure) std::rethrow_exception(failure);
  return report.good() && is_whole ? kExitDone : kExitNotGood;
}

}  // namespace

void add_record_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RecordArguments>();
  CLI::App* command = app.add_subcommand(
      "record", "Record a sensor into a log that can be reconstructed, replayed and shared");
  command->add_option("-o,--output", arguments->output, "Log to write (default: gelslam-DATE-TIME.mkv here)");
  const auto add_for_each_sensor = [&](const char* name, std::vector<std::string>& values,
                                       const char* words) {
    return command->add_option(name, values, words)->allow_extra_args(false);
  };
  auto* device =
      add_for_each_sensor("--camera", arguments->devices,
                          "Camera: a path, a number or part of its name (default: the "
                          "configuration's, else the one that looks like the sensor). Given twice: "
                          "one log of two sensors");
  add_for_each_sensor("--from", arguments->from,
                      "Another log instead of a camera: converts videos and folders. Given twice: one log of "
                      "two that were recorded at the same time")
      ->excludes(device);
  command->add_option("--seconds", arguments->seconds, "Stop after this many seconds (default: at Ctrl-C)")
      ->check(number_between(0.01, 1e6));
  command->add_flag(
      "--resized", arguments->resized,
      "Store the resized pictures that tracking uses, without loss (PNG), instead of the camera's own");
  add_for_each_sensor("--config", arguments->configs,
                      "Configuration to use and to store in the log. Given twice: one for each sensor");
  add_for_each_sensor("--model", arguments->models,
                      "Gradient model nnmodel.pth to store in the log. Given twice: one for each sensor");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Example: gelslam record --model nnmodel.pth --seconds 60 -o scan.mkv\n"
      "         gelslam record --camera 0 --camera 2 --model one.pth --model two.pth -o both.mkv\n"
      "Exit code 1: nothing was recorded, or not all (disk full or too slow).");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
