#include "gelslam/calibration/label_session.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr double kDoubtfulConfidence = 0.8;  // clear contacts of three sensors: 0.8 and more
constexpr double kOddDistance = 0.25;        // of the radius, between a label and what was found
constexpr double kMinOddPx = 5.0;
constexpr double kMinLabelRadiusPx = 2.0;

bool contact_was_found(const FoundCircle& found) { return found.problem.empty(); }

std::string doubt_about(const CalibrationPress& press, const FoundCircle& found) {
  if (!press.problem.empty()) return press.problem;
  if (!contact_was_found(found)) return found.problem;
  if (press.label) {
    const double distance_px =
        std::hypot(press.label->u_px - found.circle.u_px, press.label->v_px - found.circle.v_px);
    if (distance_px > std::max(kMinOddPx, kOddDistance * press.label->radius_px))
      return fmt::format("its label lies {:.0f} px beside the contact that was found", distance_px);
  }
  if (found.confidence < kDoubtfulConfidence) return "the circle is not sure";
  return "";
}

/// Where a person starts when nothing was found.
ContactCircle circle_in_the_middle(const cv::Size& picture) {
  return {0.5 * picture.width, 0.5 * picture.height, 0.125 * picture.height};
}

PressLabel first_label(std::size_t press, const PressSet& set, const FoundCircle& found) {
  const CalibrationPress& shown = set.presses[press];
  PressLabel label;
  label.press = press;
  label.doubt = doubt_about(shown, found);
  if (shown.label) {
    label.circle = *shown.label;
    label.origin = LabelOrigin::from_file;
    label.state = LabelState::accepted;
  } else {
    label.circle = found.circle.radius_px > kMinLabelRadiusPx ? found.circle
                                                              : circle_in_the_middle(set.background.size());
  }
  if (shown.left_out) label.state = LabelState::left_out;
  return label;
}

ContactCircle within_sight(ContactCircle circle, const cv::Size& picture) {
  circle.radius_px =
      std::clamp(circle.radius_px, kMinLabelRadiusPx, std::hypot(picture.width, picture.height));
  const double beyond = circle.radius_px - kMinLabelRadiusPx;
  circle.u_px = std::clamp(circle.u_px, -beyond, picture.width - 1.0 + beyond);
  circle.v_px = std::clamp(circle.v_px, -beyond, picture.height - 1.0 + beyond);
  return circle;
}

bool same_circle(const ContactCircle& a, const ContactCircle& b) {
  return a.u_px == b.u_px && a.v_px == b.v_px && a.radius_px == b.radius_px;
}

void remove_label_file(const fs::path& file) {
  std::error_code failure;
  fs::remove(file, failure);
  if (failure) throw Error("cannot remove '" + file.string() + "': " + failure.message());
}

void remove_decision(const fs::path& press_folder) {
  remove_label_file(press_folder / kLabelFile);
  remove_label_file(press_folder / kLeftOutFile);
}

}  // namespace

LabelSession::LabelSession(PressSet set, std::vector<FoundCircle> found)
    : set_(std::move(set)), found_(std::move(found)) {
  if (found_.size() != set_.presses.size() || found_.empty())
    throw std::invalid_argument("a circle for every press is needed");
  for (std::size_t k = 0; k < found_.size(); ++k) labels_.push_back(first_label(k, set_, found_[k]));
  std::stable_partition(labels_.begin(), labels_.end(), [](const PressLabel& l) { return !l.doubt.empty(); });
  on_disk_ = labels_;
  if (labels_.front().state != LabelState::open) show_next_open();  // stays when there is none
}

LabelCounts LabelSession::counts() const {
  LabelCounts counts;
  counts.presses = labels_.size();
  for (const PressLabel& label : labels_) {
    counts.accepted += label.state == LabelState::accepted ? 1 : 0;
    counts.left_out += label.state == LabelState::left_out ? 1 : 0;
    counts.doubtful += label.state == LabelState::open && !label.doubt.empty() ? 1 : 0;
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

void LabelSession::remember(std::vector<std::size_t> labels) {
  Change change{current_, {}};
  for (const std::size_t k : labels) change.before.emplace_back(k, labels_[k]);
  changes_.push_back(std::move(change));
}

bool LabelSession::put(const ContactCircle& circle, bool goes_on) {
  if (!std::isfinite(circle.u_px + circle.v_px + circle.radius_px)) return false;
  const ContactCircle next = within_sight(circle, set_.background.size());
  if (same_circle(next, label().circle)) return false;
  if (!goes_on) remember({current_});
  labels_[current_].circle = next;
  labels_[current_].origin = LabelOrigin::by_hand;
  return true;
}

void LabelSession::put_found() {
  if (!contact_was_found(found()) || same_circle(label().circle, found().circle)) return;
  remember({current_});
  labels_[current_].circle = found().circle;
  labels_[current_].origin = LabelOrigin::found;
}

void LabelSession::decide(LabelState state) {
  if (label().state != state) {
    remember({current_});
    labels_[current_].state = state;
  }
  if (!show_next_open()) show_next();
}

void LabelSession::accept() { decide(LabelState::accepted); }

void LabelSession::leave_out() { decide(LabelState::left_out); }

std::size_t LabelSession::accept_rest() {
  std::vector<std::size_t> accepted, unclear;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    if (labels_[k].state != LabelState::open) continue;
    const bool has_circle =
        contact_was_found(found_[labels_[k].press]) || labels_[k].origin == LabelOrigin::by_hand;
    (has_circle ? accepted : unclear).push_back(k);
  }
  if (!accepted.empty()) remember(accepted);
  for (const std::size_t k : accepted) labels_[k].state = LabelState::accepted;
  if (!unclear.empty()) current_ = unclear.front();
  return unclear.size();
}

void LabelSession::show(std::size_t label) { current_ = std::min(label, labels_.size() - 1); }

void LabelSession::show_next() { show(current_ + 1); }

void LabelSession::show_previous() {
  if (current_ > 0) --current_;
}

/// The next one after this, or else the first one; false where none is open.
bool LabelSession::show_next_open() {
  for (std::size_t step = 1; step <= labels_.size(); ++step) {
    const std::size_t k = (current_ + step) % labels_.size();
    if (labels_[k].state != LabelState::open) continue;
    current_ = k;
    return true;
  }
  return false;
}

bool LabelSession::undo() {
  if (changes_.empty()) return false;
  const Change change = std::move(changes_.back());
  changes_.pop_back();
  for (const auto& [k, before] : change.before) labels_[k] = before;
  current_ = change.shown;
  return true;
}

bool LabelSession::is_saved(std::size_t label) const {
  const PressLabel &now = labels_[label], &then = on_disk_[label];
  return now.state == then.state && (now.state == LabelState::open || same_circle(now.circle, then.circle));
}

std::size_t LabelSession::unsaved() const {
  std::size_t count = 0;
  for (std::size_t k = 0; k < labels_.size(); ++k) count += is_saved(k) ? 0 : 1;
  return count;
}

std::size_t LabelSession::save() {
  const std::size_t to_write = unsaved();
  std::string problem;
  for (std::size_t k = 0; k < labels_.size(); ++k) {
    try {
      if (!is_saved(k)) save_one(k);
    } catch (const Error& error) {
      if (problem.empty()) problem = error.what();
    }
  }
  if (const std::size_t left = unsaved(); left > 0)
    throw Error(std::to_string(left) + " of " + std::to_string(to_write) +
                " presses could not be saved: " + problem);
  return to_write;
}

void LabelSession::save_one(std::size_t k) {
  const PressLabel& label = labels_[k];
  const fs::path folder = set_.folder / set_.presses[label.press].name;
  if (label.state == LabelState::open)
    remove_decision(folder);  // saved, and then taken back
  else
    write_decision(folder, label.circle, label.state == LabelState::left_out);
  on_disk_[k] = label;
}

void write_decision(const fs::path& press_folder, const ContactCircle& circle, bool left_out) {
  // The new file is there before the old one goes: whatever happens between, the press counts as left out.
  const fs::path kept = press_folder / (left_out ? kLeftOutFile : kLabelFile),
                 gone = press_folder / (left_out ? kLabelFile : kLeftOutFile);
  write_label(kept, circle);
  remove_label_file(gone);
}

}  // namespace gelslam
