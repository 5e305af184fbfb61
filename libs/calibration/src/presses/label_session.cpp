#include "gelslam/calibration/label_session.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr double kUncertainConfidence = 0.8;  // Clear contacts of three sensors had 0.8 or more.
// Distance between a label and the found circle, relative to the radius.
constexpr double kOddDistance = 0.25;
constexpr double kMinOddPx = 5.0;
constexpr double kMinLabelRadiusPx = 2.0;

std::string warning_about(const CalibrationPress& press, const FoundCircle& found) {
  if (!press.problem.empty()) return press.problem;
  if (!found.problem.empty()) return found.problem;
  if (press.label) {
    const double distance_px =
        std::hypot(press.label->u_px - found.circle.u_px, press.label->v_px - found.circle.v_px);
    if (distance_px > std::max(kMinOddPx, kOddDistance * press.label->radius_px))
      return fmt::format("its label lies {:.0f} px beside the contact that was found", distance_px);
  }
  if (found.confidence < kUncertainConfidence) return "the circle is not sure";
  return "";
}

/// Returns the initial circle that the user moves into place if none was found.
ContactCircle circle_in_the_middle(const cv::Size& picture) {
  return {0.5 * picture.width, 0.5 * picture.height, 0.125 * picture.height};
}

ContactCircle within_sight(ContactCircle circle, const cv::Size& picture) {
  circle.radius_px =
      std::clamp(circle.radius_px, kMinLabelRadiusPx, std::hypot(picture.width, picture.height));
  const double beyond = circle.radius_px - kMinLabelRadiusPx;
  circle.u_px = std::clamp(circle.u_px, -beyond, picture.width - 1.0 + beyond);
  circle.v_px = std::clamp(circle.v_px, -beyond, picture.height - 1.0 + beyond);
  return circle;
}

void write_decision(const fs::path& press_folder, const ContactCircle& circle, bool left_out) {
  // The new file is written before the old one is removed. If the program is interrupted in between, the
  // press counts as left out.
  const fs::path kept = press_folder / (left_out ? kLeftOutFile : kLabelFile),
                 gone = press_folder / (left_out ? kLabelFile : kLeftOutFile);
  write_label(kept, circle);
  std::error_code failure;
  fs::remove(gone, failure);
  if (failure) throw Error("cannot remove '" + gone.string() + "': " + failure.message());
}

}  // namespace

LabelSession::LabelSession(PressSet set, std::vector<FoundCircle> found)
    : set_(std::move(set)), found_(std::move(found)) {
  for (std::size_t k = 0; k < found_.size(); ++k) labels_.push_back(first_label(k));
  std::stable_partition(labels_.begin(), labels_.end(),
                        [](const PressLabel& l) { return !l.warning.empty(); });
  // Stays at the first one if none is open.
  if (!labels_.empty() && label().state != LabelState::open) show_next_open();
}

PressLabel LabelSession::first_label(std::size_t press) const {
  const CalibrationPress& shown = set_.presses[press];
  const FoundCircle& found = found_[press];
  PressLabel label;
  label.press = press;
  label.warning = warning_about(shown, found);
  if (shown.label) {
    label.circle = *shown.label;
    label.origin = LabelOrigin::from_file;
    label.state = LabelState::accepted;
  } else {
    label.circle = found.circle.radius_px > kMinLabelRadiusPx ? found.circle
                                                              : circle_in_the_middle(set_.background.size());
  }
  if (shown.left_out) label.state = LabelState::left_out;
  return label;
}

void LabelSession::add(CalibrationPress press, const FoundCircle& found, const cv::Mat3b& background) {
  if (set_.background.empty()) set_.background = background;
  press.label = found.circle;
  set_.presses.push_back(std::move(press));
  found_.push_back(found);
  labels_.push_back(first_label(found_.size() - 1));
  labels_.back().origin = LabelOrigin::found;
}

LabelCounts LabelSession::counts() const {
  LabelCounts counts;
  counts.presses = labels_.size();
  for (const PressLabel& label : labels_) {
    counts.accepted += label.state == LabelState::accepted ? 1 : 0;
    counts.left_out += label.state == LabelState::left_out ? 1 : 0;
    counts.doubtful += label.state == LabelState::open && !label.warning.empty() ? 1 : 0;
  }
  return counts;
}

std::string LabelSession::progress() const {
  const LabelCounts now = counts();
  std::string text = fmt::format("{} of {} accepted", now.accepted, now.presses);
  if (now.doubtful > 0) text += fmt::format(", {} doubtful", now.doubtful);
  if (now.left_out > 0) text += fmt::format(", {} left out", now.left_out);
  return text;
}

/// Says whether the circle was found reliably or was placed by the user.
bool LabelSession::has_contact(const PressLabel& label) const {
  return label.origin != LabelOrigin::found ||
         (found_[label.press].problem.empty() && set_.presses[label.press].problem.empty());
}

std::vector<ContactCircle> LabelSession::contacts(double diameter_mm) const {
  std::vector<ContactCircle> circles;
  for (const PressLabel& label : labels_) {
    const CalibrationPress& press = set_.presses[label.press];
    if (press.diameter_mm == diameter_mm && press.problem.empty() && label.state != LabelState::left_out &&
        has_contact(label))
      circles.push_back(label.circle);
  }
  return circles;
}

void LabelSession::put(const ContactCircle& circle) {
  if (!std::isfinite(circle.u_px + circle.v_px + circle.radius_px)) return;
  const ContactCircle next = within_sight(circle, set_.background.size());
  PressLabel& label = labels_[current_];
  if (next == label.circle) return;
  label.circle = next;
  label.origin = LabelOrigin::by_hand;
  label.is_saved = false;
}

bool LabelSession::decide(LabelState state) {
  PressLabel& label = labels_[current_];
  label.is_saved = label.is_saved && label.state == state;
  label.state = state;
  if (show_next_open()) return true;
  show(current_ + 1);
  return false;
}

bool LabelSession::accept() { return decide(LabelState::accepted); }

bool LabelSession::leave_out() { return decide(LabelState::left_out); }

std::size_t LabelSession::accept_rest() {
  std::vector<std::size_t> unclear;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    PressLabel& label = labels_[k];
    if (label.state != LabelState::open) continue;
    if (has_contact(label)) {
      label.state = LabelState::accepted;
      label.is_saved = false;
    } else {
      unclear.push_back(k);
    }
  }
  if (!unclear.empty()) current_ = unclear.front();
  return unclear.size();
}

void LabelSession::show(std::size_t label) { current_ = std::min(label, labels_.size() - 1); }

/// Shows the next open press after the current one, or else the first open one. Returns false if none is
/// open.
bool LabelSession::show_next_open() {
  for (std::size_t step = 1; step <= labels_.size(); ++step) {
    const std::size_t k = (current_ + step) % labels_.size();
    if (labels_[k].state != LabelState::open) continue;
    current_ = k;
    return true;
  }
  return false;
}

std::size_t LabelSession::unsaved() const {
  return static_cast<std::size_t>(std::ranges::count_if(
      labels_, [](const PressLabel& label) { return label.state != LabelState::open && !label.is_saved; }));
}

void LabelSession::save() {
  const std::size_t to_write = unsaved();
  std::string problem;
  for (PressLabel& label : labels_) {
    if (label.state == LabelState::open || label.is_saved) continue;
    try {
      write_decision(set_.folder / set_.presses[label.press].name, label.circle,
                     label.state == LabelState::left_out);
      label.is_saved = true;
    } catch (const Error& error) {
      if (problem.empty()) problem = error.what();
    }
  }
  if (const std::size_t left = unsaved(); left > 0)
    throw Error(std::to_string(left) + " of " + std::to_string(to_write) +
                " presses could not be saved: " + problem);
}

}  // namespace gelslam
