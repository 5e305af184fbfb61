#include "reports.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "command_line.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background.hpp"
#include "terminal_progress.hpp"

namespace gelslam {

std::string map_words(const RunReport& r) {
  return counted(r.frames.in_map, "frame") + " in the map; " + counted(r.trials, "trial") + " in " +
         counted(r.components, "piece") + ", " + counted(r.keyframes, "keyframe") + ", " +
         counted(r.loops, "loop");
}

std::string mesh_words(const RunReport::MeshSize& mesh) {
  std::string text = "no mesh";
  if (mesh.triangles > 0)
    text =
        "mesh of " + std::to_string(mesh.vertices) + " vertices and " + counted(mesh.triangles, "triangle");
  if (mesh.islands_left_out > 0)
    text += ", without " + counted(mesh.islands_left_out, "island") + " (gelslam fuse --keep-all keeps them)";
  return text;
}

std::string warning_words(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& sentence : warnings)
    text += amber("warning: " + one_line(sentence), STDERR_FILENO) + "\n";
  return text;
}

void say_reservations(const std::filesystem::path& run_folder) {
  if (const auto report = find_report(run_folder)) std::cerr << warning_words(report->reservations);
}

std::string run_words(const RunReport& r, const std::string& run_folder, bool quiet) {
  std::string text;
  if (r.partial) text += "stopped early: this is what was seen so far\n";
  text += warning_words(r.warnings);
  const std::string last = warning_words(r.reservations);
  if (quiet) return text + last;
  for (const std::string& part : r.parts) text += one_line(part) + "\n";
  text += fmt::format("{} of {} frames tracked, {}\n{}, in {} s: {}\n", r.frames.tracked, r.frames.total,
                      map_words(r), mesh_words(r.mesh), short_number(r.seconds, 3), one_line(run_folder));
  return text + last;
}

void warn(const std::string& warning) {
  if (!warning.empty()) std::cerr << warning_words({warning});
}

RecordReport::RecordReport(const std::string& log, bool quiet, const RawFrameSource& source)
    : source_(source), log_(log), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0) {}

void RecordReport::start() {
  if (!quiet_) print_line("recording " + source_.description() + " (Ctrl-C ends it)");
}

void RecordReport::say(const std::string& sentence) {
  clear_line();
  print_line("gelslam: " + sentence);
}

void RecordReport::count(const RawFrame& frame, const LogRecorderStatus& status) {
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
  std::cerr << "\r" << frames_ << " frames  " << fmt::format("{:.1f} s", last_s_ - first_s_) << "  "
            << fmt::format("{:.1f} Hz", rate_hz()) << "  " << source_.lost_frames() << " lost  "
            << bytes_text(status.bytes) << "\x1b[K" << std::flush;
}

void RecordReport::finish(const LogRecorderStatus& status) {
  clear_line();
  good_ = status.written > 0 && !status.stopped && status.left_out == 0;
  if (const std::string warning = source_.warning(); !warning.empty()) say("warning: " + warning);
  if (!status.warning.empty() && status.warning != said_) say("warning: " + status.warning);
  if (status.damaged > 0) say("warning: left out " + counted(status.damaged, "damaged picture"));
  if (status.written == 0) {
    say("nothing was recorded");
    return;
  }
  if (quiet_) return;
  std::cerr << "recorded " << counted(status.written, "frame");
  if (status.written == frames_)  // else the times are not those of what was recorded
    std::cerr << " in " << fmt::format("{:.1f} s", last_s_ - first_s_) << " ("
              << fmt::format("{:.2f} Hz", rate_hz()) << ")";
  std::cerr << ", " << source_.lost_frames() << " lost by the camera, " << bytes_text(status.bytes) << ": "
            << one_line(log_) << "\n";
}

void RecordReport::clear_line() {
  if (drawn_) std::cerr << "\r\x1b[K";
  drawn_ = false;
}

double RecordReport::rate_hz() const {
  return last_s_ > first_s_ ? (static_cast<double>(frames_) - 1) / (last_s_ - first_s_) : 0.0;
}

StartCheck::StartCheck(const Config& config, std::function<void(const std::string&)> say_doubt)
    : config_(config), color_gain_(config.color_gain_bgr), say_doubt_(std::move(say_doubt)) {
  decoder_.emplace(config_.sensor);
}

void StartCheck::look_at(const RawFrame& frame) {
  if (!decoder_) return;
  try {
    if (std::optional<TactileImage> image = decoder_->decode(frame)) {
      color_gain_.apply(image->bgr);
      pictures_.push_back(image->bgr.clone());
    } else if (pictures_.empty() && frame.index == 0) {
      say_doubt_("the first picture cannot be decoded: " + decoder_->damage());
    }
    if (static_cast<int>(pictures_.size()) < config_.background_frames) return;
    judge();
  } catch (const Error& error) {  // a size that never fits: the log may be wanted all the same
    say_doubt_(error.what());
  }
  decoder_.reset();
  pictures_.clear();
}

void StartCheck::judge() {
  const std::filesystem::path& file = config_.sensor.calibration_model_path;
  std::optional<GradientModel> model;
  if (!file.empty()) model = read_gradient_model(file);
  const cv::Mat3b mean = background_image(pictures_);
  for (const std::string& doubt : judge_background(mean, config_.sensor.device_name,
                                                   model ? &*model : nullptr, config_.surface.pixel_pitch_mm))
    say_doubt_(doubt);
  if (!model) return;
  const BackgroundCheck check = check_background(pictures_, *model, config_.surface);
  if (check.contact)
    say_doubt_("the first " + std::to_string(pictures_.size()) + " frames should show the bare gel, but " +
               check.reason);
}

}  // namespace gelslam
