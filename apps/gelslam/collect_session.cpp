// Collects ball presses from a camera or a log: decodes each picture, gives it to the PressCollector, which
// finds the bare gel and presses that hold still, and writes them into the calibration folder at once, so
// that nothing is lost when the session ends. view() gives a window the state; a mutex separates the two
// threads.

#include "collect_session.hpp"

#include <exception>
#include <utility>

#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/surface/background.hpp"

namespace gelslam {
namespace {

const char* headline_for(const CollectorStatus& status) {
  if (status.phase == CollectPhase::background) return "Keep everything off the gel";
  if (status.phase == CollectPhase::ready) return "Press the ball in";
  if (status.phase == CollectPhase::taken) return "Taken: lift the ball";
  return status.warning.empty() ? "Hold it still" : "Not taken yet";
}

}  // namespace

CollectSession::CollectSession(RawFrameSource& source, const SensorProfile& profile, PressFolder folder,
                               const CollectOptions& options, std::function<void(const std::string&)> say)
    : source_(source),
      profile_(profile),
      options_(options),
      say_(std::move(say)),
      collector_(options),
      folder_(std::move(folder)),
      coverage_(cv::Size(profile.width_px, profile.height_px), options.presses) {}

void CollectSession::run() {
  {
    const std::lock_guard lock(mutex_);
    if (const int before = coverage_.total(); before > 0)
      say_("going on after " + counted(before, "press") + " of this ball taken before");
  }
  if (options_.headless && enough()) return;
  std::exception_ptr failure;
  try {
    watch();
  } catch (...) {  // For example, the camera was unplugged. The press that is still held is kept.
    failure = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  if (const auto held = collector_.finish()) keep(*held);
  if (failure) std::rethrow_exception(failure);
  if (collector_.background().empty()) refuse_without_background();
}

void CollectSession::watch() {
  FrameDecoder decoder(profile_);
  say_("keep everything off the gel");
  while (!stops_ && !(options_.headless && enough())) {
    const std::optional<RawFrame> frame = source_.next();
    if (!frame) break;
    const std::optional<TactileImage> image = decoder.decode(*frame);
    const std::lock_guard lock(mutex_);
    if (!image) {
      ++damaged_;
      continue;
    }
    look_at(image->bgr);
  }
}

void CollectSession::refuse_without_background() const {
  if (stops_) throw Error("stopped before the bare gel was seen; nothing was written");
  const std::string& why = collector_.status().warning;
  throw Error("the bare gel was never seen, nothing was written: " +
              (why.empty() ? std::string("there were too few pictures before the first touch") : why) +
              "; begin with nothing on the gel, for half a second");
}

void CollectSession::look_at(const cv::Mat3b& bgr) {
  const bool had_background = !collector_.background().empty();
  newest_ = bgr.clone();
  if (const auto press = collector_.add(bgr)) keep(*press);
  if (!had_background && !collector_.background().empty()) begin_presses();
  say_warning();
}

void CollectSession::begin_presses() {
  require_readable_background(collector_.background(), profile_.device_name, "the bare gel", say_);
  folder_.require_same_gel(collector_.background());
  folder_.write_background(collector_.background());
  if (options_.keep_optics) write_optics(options_.folder / kOpticsFileName, options_.optics);
  collector_.set_background(folder_.background());
  say_("bare gel seen; " + coverage_.advice());
}

void CollectSession::add(const ContactCircle& circle) {
  coverage_.add(circle);
  const double ball_px = 0.5 * options_.diameter_mm / options_.pixel_pitch_mm;
  rim_slopes_.push_back(rim_slope(circle.on_ball_px(options_.pixel_pitch_mm), ball_px));
}

/// Returns a warning if presses of some depths are missing. It is empty before enough presses were taken.
std::string CollectSession::depth_warning() const {
  constexpr std::size_t enough_to_tell = 9;
  return rim_slopes_.size() < enough_to_tell ? "" : missing_depths(rim_slopes_);
}

void CollectSession::keep(const CollectedPress& press) {
  const std::string name = folder_.add(press);
  add(press.circle);
  ++taken_now_;
  taken_.push_back(
      {{name, options_.diameter_mm, press.bgr, std::nullopt}, {press.circle, press.confidence, ""}});
  say_("taken: " + name + " (" + std::to_string(coverage_.total()) + ", wanted " +
       std::to_string(coverage_.wanted()) + "); " + coverage_.advice());
}

/// Prints a warning when it changes. A warning that only lacks the words "not taken: " of the one before it
/// is not printed again.
void CollectSession::say_warning() {
  const std::string& warning = collector_.status().warning;
  if (warning == warned_) return;
  const bool said = warning == "not taken: " + warned_;
  warned_ = warning;
  if (!warning.empty() && !said) say_(warning);
}

void CollectSession::stop() {
  stops_ = true;
  source_.stop();
}

std::vector<TakenPress> CollectSession::taken() {
  const std::lock_guard lock(mutex_);
  return std::exchange(taken_, {});
}

void CollectSession::count(const std::vector<ContactCircle>& contacts) {
  const std::lock_guard lock(mutex_);
  coverage_ = PressCoverage(cv::Size(profile_.width_px, profile_.height_px), options_.presses);
  rim_slopes_.clear();
  for (const ContactCircle& contact : contacts) add(contact);
}

CollectView CollectSession::view() const {
  const std::lock_guard lock(mutex_);
  const CollectorStatus& status = collector_.status();
  CollectView view;
  view.bgr = newest_;
  view.background = folder_.background();
  view.circle = status.found;
  view.circle_is_good = status.phase == CollectPhase::taken;
  view.coverage = coverage_;
  view.headline =
      coverage_.enough() && status.phase == CollectPhase::ready ? "Enough presses" : headline_for(status);
  if (status.phase == CollectPhase::ready)
    view.hint = coverage_.enough() ? "all over the gel; Q ends" : coverage_.advice();
  view.warning = status.warning;
  view.closes = closes_;
  return view;
}

int CollectSession::taken_now() const {
  const std::lock_guard lock(mutex_);
  return taken_now_;
}

bool CollectSession::enough() const {
  const std::lock_guard lock(mutex_);
  return coverage_.enough();
}

std::string CollectSession::summary() const {
  const std::lock_guard lock(mutex_);
  std::string text = counted(taken_now_, "press") + " taken, " + std::to_string(coverage_.total()) + " of " +
                     std::to_string(coverage_.wanted()) + " wanted of this ball are in '" +
                     options_.folder.string() + "'";
  if (const std::string gaps = coverage_.gaps(); !gaps.empty()) text += "; missing at the " + gaps;
  if (const std::string warning = depth_warning(); !warning.empty()) text += "; " + warning;
  if (damaged_ > 0) text += "; left out " + counted(damaged_, "damaged picture");
  return text;
}

}  // namespace gelslam
