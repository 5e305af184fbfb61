#include <fmt/core.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/label_session.hpp"
#include "gelslam/calibration/label_window.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/viewer/gl_context.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct LabelArguments {
  PressOptions presses;
  fs::path sheet, snapshot;
  bool accept = false, overwrite = false, headless = false;

  bool wants_window() const {
    return !snapshot.empty() || (!headless && !accept && sheet.empty() && has_display());
  }
  bool writes_labels() const { return accept || (wants_window() && snapshot.empty()); }
};

void draw_circle_and_center(cv::Mat3b& image, ContactCircle circle, const cv::Scalar& bgr) {
  draw_circle(image, circle, bgr);
  circle.radius_px = 1.0;
  draw_circle(image, circle, bgr);
}

/// All presses beside each other, the change against the background doubled; white: found, black: the label
/// there.
void write_sheet(const fs::path& path, const PressSet& set, const std::vector<FoundCircle>& found) {
  constexpr int columns = 6;
  const int rows = (static_cast<int>(found.size()) + columns - 1) / columns;
  const cv::Size size = set.background.size();
  cv::Mat3b sheet(rows * size.height, columns * size.width, cv::Vec3b(0, 0, 0));
  for (std::size_t k = 0; k < found.size(); ++k) {
    cv::Mat3s change;
    cv::subtract(set.presses[k].bgr, set.background, change, cv::noArray(), CV_16S);
    cv::Mat3b picture;
    change.convertTo(picture, CV_8U, 2.0, 128.0);
    if (set.presses[k].label) draw_circle_and_center(picture, *set.presses[k].label, cv::Scalar(0, 0, 0));
    if (found[k].problem.empty()) draw_circle_and_center(picture, found[k].circle, cv::Scalar(255, 255, 255));
    cv::putText(picture, set.presses[k].name, cv::Point(4, 14), cv::FONT_HERSHEY_SIMPLEX, 0.45,
                cv::Scalar(255, 255, 255));
    const int place = static_cast<int>(k);
    picture.copyTo(
        sheet(cv::Rect(cv::Point(place % columns * size.width, place / columns * size.height), size)));
  }
  write_png(path, sheet);
}

const char* said_of(const CalibrationPress& press) {
  if (press.left_out) return "  stays left out";
  return press.label ? "  keeps its label" : "";
}

std::vector<FoundCircle> find_all(const PressSet& set, const LabelArguments& arguments) {
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.presses.quiet);
  std::vector<FoundCircle> found;
  progress->begin("labeling", static_cast<std::int64_t>(set.presses.size()));
  for (const CalibrationPress& press : set.presses) {
    stop_if_asked(interrupt);
    found.push_back(
        find_circle(press.bgr, set.background, set.camera(arguments.presses.pitch_mm), press.diameter_mm));
    progress->update(static_cast<std::int64_t>(found.size()));
  }
  progress->end();
  return found;
}

int label_in_window(const LabelArguments& arguments, PressSet set, std::vector<FoundCircle> found) {
  LabelWindowOptions options;
  options.title = "Labels of " + set.folder.string() + " - GelSLAM";
  options.pixel_pitch_mm = arguments.presses.pitch_mm;
  LabelSession session(std::move(set), std::move(found));
  if (!arguments.snapshot.empty()) {
    write_label_snapshot(session, arguments.snapshot, options);
    std::cerr << "wrote " << arguments.snapshot.string() << "; no label was written\n";
    return kExitDone;
  }
  const InterruptWatch interrupt;
  options.asks_to_end = [&] { return interrupt.requested(); };
  const std::size_t written = run_label_window(session, options);
  const LabelCounts counts = session.counts();
  const std::size_t open = counts.presses - counts.accepted - counts.left_out;
  std::cerr << session.progress() << "; " << written << " written";
  if (open > 0) std::cerr << "; " << open << " not decided yet: the same command continues with them";
  std::cerr << "\n";
  return open == 0 ? kExitDone : kExitNotGood;
}

int label_in_terminal(const LabelArguments& arguments, const PressSet& set,
                      const std::vector<FoundCircle>& found) {
  std::size_t unclear = 0, written = 0, kept = 0;
  fmt::print("{:<16} {:>8} {:>8} {:>8} {:>11}\n", "press", "u px", "v px", "radius", "confidence");
  for (std::size_t k = 0; k < found.size(); ++k) {
    const CalibrationPress& press = set.presses[k];
    const bool keep = (press.label || press.left_out) && !arguments.overwrite;
    const ContactCircle& circle = found[k].circle;
    if (const std::string& problem = press.problem.empty() ? found[k].problem : press.problem;
        !problem.empty()) {
      ++unclear;
      fmt::print("{:<16} {}{}\n", press.name, problem, said_of(press));
      continue;
    }
    fmt::print("{:<16} {:8.1f} {:8.1f} {:8.1f} {:11.2f}{}\n", press.name, circle.u_px, circle.v_px,
               circle.radius_px, found[k].confidence, keep ? said_of(press) : "");
    kept += keep ? 1 : 0;
    if (!arguments.accept || keep) continue;
    write_decision(set.folder / press.name, circle, false);
    ++written;
  }
  if (!arguments.sheet.empty()) write_sheet(arguments.sheet, set, found);
  if (arguments.accept)
    std::cerr << written << " labels written, " << kept << " kept, " << unclear << " presses not clear\n";
  else
    std::cerr << "nothing was written; --accept writes these labels\n";
  return unclear == 0 ? kExitDone : kExitNotGood;
}

int run_label(LabelArguments arguments) {
  check_output_file(arguments.sheet, arguments.overwrite);
  check_output_file(arguments.snapshot, arguments.overwrite);
  const FolderLock lock = arguments.writes_labels() && fs::is_directory(arguments.presses.folder)
                              ? FolderLock(arguments.presses.folder)
                              : FolderLock();
  PressSet set = read_presses(arguments.presses);
  std::vector<FoundCircle> found = find_all(set, arguments);
  return arguments.wants_window() ? label_in_window(arguments, std::move(set), std::move(found))
                                  : label_in_terminal(arguments, set, found);
}

}  // namespace

void add_calibrate_label_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("label", "Find the contact circle of every press");
  const auto arguments = std::make_shared<LabelArguments>();
  arguments->presses.add_to(*command);
  command->add_flag("--headless", arguments->headless, "No window: circles as a table, nothing is written");
  CLI::Option* accept =
      command->add_flag("--accept", arguments->accept, "No window: write label.npz for every circle found");
  command->add_flag("--overwrite", arguments->overwrite, "Also replace labels that are there");
  CLI::Option* sheet = command
                           ->add_option("--sheet", arguments->sheet,
                                        "No window: write a picture of all presses with their circles (.png)")
                           ->check(refuse_unless_png);
  command
      ->add_option("--snapshot", arguments->snapshot,
                   "Write a picture of the window (PNG) instead; needs no display")
      ->check(refuse_unless_png)
      ->excludes(accept)
      ->excludes(sheet);
  command->footer(
      "Opens a window. Move a circle with the mouse or the arrow keys; Enter accepts it, X leaves the press "
      "out,\nA accepts all that remain, Q saves and ends.\n"
      "Exit code 1: some presses are not clear, or not decided yet.\n"
      "Example: gelslam calibrate label PRESSES\n"
      "Example: gelslam calibrate label PRESSES --sheet circles.png, look at it, then gelslam calibrate "
      "label PRESSES --accept");
  command->callback([arguments, &exit_code] { exit_code = run_label(*arguments); });
}

}  // namespace gelslam
