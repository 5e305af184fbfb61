#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/background.hpp"
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

/// Messages of a recording to the user, on stderr.
class RecordReport {
 public:
  RecordReport(const std::string& log, bool quiet, const RawFrameSource& source)
      : source_(source), log_(log), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0) {
    if (!quiet_) print_line("recording " + source_.description() + " (Ctrl-C ends it)");
  }

  /// Prints a sentence on its own line, also in quiet mode.
  void say(const std::string& sentence) {
    clear_line();
    print_line("gelslam: " + sentence);
  }

  /// Called for every frame. Draws the progress line from time to time, and prints new warnings.
  void count(const RawFrame& frame, const LogRecorderStatus& status) {
    if (frames_++ == 0) first_s_ = frame.time_s;
    last_s_ = std::max(last_s_, frame.time_s);
    if (!status.warning.empty() && said_.empty()) {
      said_ = status.warning;
      say("warning: " + status.warning);
    }
    const auto now = std::chrono::steady_clock::now();
    if (quiet_ || !terminal_ || now - drawn_at_ < std::chrono::milliseconds(200)) return;
    drawn_at_ = now;
    drawn_ = true;
    std::cerr << fmt::format("\r{} frames  {:.1f} s  {:.1f} Hz  {} lost  {}\x1b[K", frames_,
                             last_s_ - first_s_, rate_hz(), source_.lost_frames(), bytes_text(status.bytes))
              << std::flush;
  }

  /// Returns whether everything was recorded.
  bool finish(const LogRecorderStatus& status) {
    clear_line();
    if (const std::string warning = source_.warning(); !warning.empty()) say("warning: " + warning);
    if (!status.warning.empty() && status.warning != said_) say("warning: " + status.warning);
    if (status.damaged > 0) say("warning: left out " + counted(status.damaged, "damaged picture"));
    if (status.written == 0) say("nothing was recorded");
    if (status.written > 0 && !quiet_) {
      // Duration and rate are printed only if all frames were recorded, as they are those of all received
      // frames.
      const std::string times = status.written == frames_
                                    ? fmt::format(" in {:.1f} s ({:.2f} Hz)", last_s_ - first_s_, rate_hz())
                                    : "";
      std::cerr << fmt::format("recorded {}{}, {} lost by the camera, {}: {}\n",
                               counted(status.written, "frame"), times, source_.lost_frames(),
                               bytes_text(status.bytes), one_line(log_));
    }
    return status.written > 0 && !status.stopped && status.left_out == 0;
  }

 private:
  void clear_line() {
    if (std::exchange(drawn_, false)) std::cerr << "\r\x1b[K";
  }
  double rate_hz() const {
    return last_s_ > first_s_ ? (static_cast<double>(frames_) - 1) / (last_s_ - first_s_) : 0.0;
  }

  const RawFrameSource& source_;
  const std::string log_;
  const bool quiet_, terminal_;
  bool drawn_ = false;
  std::string said_;  // The first warning that was printed.
  std::int64_t frames_ = 0;
  double first_s_ = 0, last_s_ = 0;
  std::chrono::steady_clock::time_point drawn_at_;
};

/// Checks a recording's first frames, which should show the bare gel, and warns about problems while the user
/// can still begin again.
class StartCheck {
 public:
  StartCheck(const Config& config, std::function<void(const std::string&)> say_warning)
      : config_(config),
        color_gain_(config.color_gain_bgr),
        say_warning_(std::move(say_warning)),
        decoder_(config_.sensor) {}

  /// Called for every frame in order; has no effect after the first few.
  void look_at(const RawFrame& frame) {
    if (!decoder_) return;
    try {
      if (std::optional<TactileImage> image = decoder_->decode(frame)) {
        color_gain_.apply(image->bgr);
        pictures_.push_back(image->bgr.clone());
      } else if (pictures_.empty() && frame.index == 0) {
        say_warning_("the first picture cannot be decoded: " + decoder_->damage());
      }
      if (static_cast<int>(pictures_.size()) < config_.background_frames) return;
      judge();
      // The size does not fit the profile; the log may be wanted all the same.
    } catch (const Error& error) {
      say_warning_(error.what());
    }
    decoder_.reset();
    pictures_.clear();
  }

 private:
  void judge() {
    const std::filesystem::path& file = config_.sensor.calibration_model_path;
    std::optional<GradientModel> model;
    if (!file.empty()) model = read_gradient_model(file);
    const cv::Mat3b mean = background_image(pictures_);
    for (const std::string& warning : judge_background(
             mean, config_.sensor.device_name, model ? &*model : nullptr, config_.surface.pixel_pitch_mm))
      say_warning_(warning);
    if (!model) return;
    const BackgroundCheck check = check_background(pictures_, *model, config_.surface);
    if (check.contact)
      say_warning_("the first " + std::to_string(pictures_.size()) +
                   " frames should show the bare gel, but " + check.reason);
  }

  const Config config_;
  ColorGain color_gain_;
  std::function<void(const std::string&)> say_warning_;
  std::optional<FrameDecoder> decoder_;  // Reset when everything has been reported.
  std::vector<cv::Mat3b> pictures_;
};

CameraInput open_log(const RecordArguments& arguments, const Config& config) {
  CameraInput log;
  log.attachments = attachments_of(config);
  log.frames = open_raw_log(arguments.from, config.sensor);
  const LogAttachments old =
      is_matroska(arguments.from) ? read_log_attachments(arguments.from) : LogAttachments{};
  log.attachments->sensor = old.sensor.empty() ? log.frames->description() : old.sensor;
  log.attachments->camera_settings = old.camera_settings;
  return log;
}

void record_all(const RecordArguments& arguments, const Config& config, RawFrameSource& source,
                LogRecorder& recorder, RecordReport& report) {
  StartCheck check(config, [&](const std::string& warning) { report.say("warning: " + warning); });
  // A log can be read as slowly as the disk takes its frames; a camera cannot wait.
  const bool can_wait = !arguments.from.empty();
  const InterruptStopper stopper(can_wait ? InterruptWatch::Ends::early : InterruptWatch::Ends::regularly,
                                 [&] { source.stop(); });
  while (std::optional<RawFrame> next = source.next()) {
    if (stopper.requested() || (arguments.seconds > 0 && next->time_s >= arguments.seconds)) return;
    check.look_at(*next);
    LogRecorderStatus status = recorder.status();
    // If the source can wait (another log), a slow disk only delays it, so the warning of a full queue does
    // not apply.
    if (can_wait && !status.stopped) status.warning.clear();
    report.count(*next, status);
    auto frame = std::make_shared<const RawFrame>(std::move(*next));
    if (can_wait)
      recorder.push_waiting(std::move(frame));
    else
      recorder.push(std::move(frame));
    if (recorder.status().stopped) return;
  }
}

int run_record(RecordArguments& arguments) {
  use_simulated_model(arguments.device, arguments.model);
  const fs::path log =
      arguments.output.empty() ? fs::path(name_by_time() + ".mkv") : fs::path(arguments.output);
  std::error_code code;
  // Checked before a camera is opened.
  if (fs::exists(log, code)) throw Error(log.string() + ": exists already; name another file");
  const Config config = find_config({.log = arguments.from,
                                     .config = arguments.config,
                                     .model = arguments.model,
                                     .track = arguments.track});
  const CameraInput source = arguments.from.empty()
                                 ? open_camera_input(config, arguments.device, kReconnectTimeoutS)
                                 : open_log(arguments, config);
  LogRecorderOptions options;
  // A source that can wait does not have to be held in memory as a whole.
  if (!arguments.from.empty()) options.max_waiting_bytes = 32u << 20;
  options.keep_free_bytes = arguments.keep_free_bytes;
  if (arguments.resized) options.resize_to = config.sensor;
  LogRecorder recorder(std::make_unique<LogWriter>(log, *source.attachments, source.frames->rate_hz()),
                       options);
  RecordReport report(log.string(), arguments.quiet, *source.frames);
  std::exception_ptr failure;
  try {
    record_all(arguments, config, *source.frames, recorder, report);
  } catch (const Error&) {
    failure = std::current_exception();
  }
  recorder.finish();
  const bool is_good = report.finish(recorder.status());
  if (failure) std::rethrow_exception(failure);
  return is_good ? kExitDone : kExitNotGood;
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
