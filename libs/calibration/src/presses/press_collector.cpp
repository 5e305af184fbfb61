// Recognizes good presses of a ball in a stream of images (not in the paper).
//
// The first frames without change are the background. A touch begins when cells differ from it. When nothing
// has changed for kStillFrames frames, their mean is judged by find_circle(); the most confident good press
// of a touch is kept and returned when the touch ends. The thresholds of change rise with the noise that was
// measured in the background.

#include "gelslam/calibration/press_collector.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>
#include <vector>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/background_drift.hpp"
#include "judging/gel_change.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr std::size_t kBackgroundFrames = 10;  // Number of frames of the bare gel at the start.
// After this many frames without change, a press counts as held still. Their mean is kept.
constexpr std::size_t kStillFrames = 6;
// Two pictures are alike if the mean colors of their cells differ by less than this, in gray levels, or by
// less than kNoiseFactor times the noise of the bare gel. A stream with more noise than kMaxNoiseLevels is
// refused.
constexpr double kMinStillLevels = 2.0;
constexpr double kNoiseFactor = 2.0, kMaxNoiseLevels = 5.0;
constexpr int kMinTouchedCells = 6;  // A smaller changed region is no touch.
// Stained share of the image. Bare gels of four sensors have at most 0.0008, and 95 % of presses more than
// 0.005.
constexpr double kMaxBareStained = 0.002;
// A ball slides if, within so many frames, its contact moves by more than so many cells while its area
// changes by less than this factor.
constexpr std::size_t kSlideFrames = 6;
constexpr double kSlideCells = 1.5, kSlideGrowth = 1.25;
// After so many presses that were held still and refused, the background itself is doubted.
constexpr int kPatienceHolds = 10;

// The contact should be an eighth to a quarter of the image wide; these limits are somewhat wider.
constexpr double kMinWidth = 1.0 / 9.0, kMaxWidth = 1.0 / 3.4;
// Radius of the contact relative to that of the ball. Beyond it the flanks of the gel are steeper than 53
// degrees, where the lamps no longer reach.
constexpr double kMaxOfBall = 0.8;
// Relative to the radius: least distance of the ball's center from the image border.
constexpr double kMinInset = 0.35;

double inset_px(const ContactCircle& circle, const cv::Size& size) {
  return std::min(
      {circle.u_px, circle.v_px, size.width - 1.0 - circle.u_px, size.height - 1.0 - circle.v_px});
}

/// Returns what the user should do better, or "" when the press is good. `free` is the circle that is found
/// if the ball's size does not limit the contact's width. `too_wide_px` is the radius of a contact that is
/// too deep.
std::string advice_about(const FoundCircle& found, const ContactCircle& free, const cv::Size& size,
                         double too_wide_px) {
  if (found.circle.radius_px == 0.0) return "too shallow: press a little deeper";
  if (found.second_contact) return "two things touch the gel: press with the ball alone";
  const double width = 2.0 * found.circle.radius_px / size.width;
  if (inset_px(found.circle, size) < kMinInset * found.circle.radius_px)
    return "too near the edge of the gel: move the ball inward";
  if (std::max(found.circle.radius_px, free.radius_px) > too_wide_px)
    return "too deep, or a smaller ball than was said: press less deep, and check the diameter";
  if (found.problem.empty() && width > kMaxWidth) return "too deep: press less deep";
  if (found.problem.empty() && width < kMinWidth) return "too shallow: press a little deeper";
  return found.problem;
}

}  // namespace

struct PressCollector::Impl {
  explicit Impl(const CollectorOptions& given) : options(given) {}

  void look_at_bare_gel(const cv::Mat3b& bgr, const cv::Mat3f& cells);
  void begin_background(const cv::Mat3b& bgr, const cv::Mat3f& cells, const std::string& why);
  void take_background();
  std::optional<CollectedPress> watch(const cv::Mat3b& bgr, const cv::Mat3f& cells);
  void look_at_light(const cv::Mat3b& bgr);
  void begin_touch();
  std::optional<CollectedPress> end_touch();
  bool slides(const ChangedPiece& piece);
  void judge_hold();
  double touch_level() const { return std::max(kMinTouchLevels, kNoiseFactor * noise_levels); }
  double still_level() const { return std::max(kMinStillLevels, kNoiseFactor * noise_levels); }

  CollectorOptions options;
  CollectorStatus status;
  cv::Size size;         // Size of all images.
  cv::Mat3b background;  // Image with which presses are compared.
  cv::Mat3f bare_cells;  // Cells of the bare gel at the start of this session.
  double noise_levels = 0.0;

  cv::Mat3f anchor;  // First frame of the sequence without change.
  std::vector<cv::Mat3b> held;
  std::optional<CollectedPress> best;
  std::deque<ChangedPiece> places;  // Contact in each of the last frames of the touch.
  int holds = 0;
  bool light_changed = false;
};

void PressCollector::Impl::begin_background(const cv::Mat3b& bgr, const cv::Mat3f& cells,
                                            const std::string& why) {
  held = {bgr.clone()};
  anchor = cells;
  noise_levels = 0.0;
  status.warning = why;
}

/// Processes a frame before there is a background. The background is the mean of kBackgroundFrames
/// consecutive frames without change or contact.
void PressCollector::Impl::look_at_bare_gel(const cv::Mat3b& bgr, const cv::Mat3f& cells) {
  if (held.empty()) return begin_background(bgr, cells, status.warning);
  const double change = largest(cell_difference(cells, anchor));
  if (change > kMaxNoiseLevels)
    return begin_background(bgr, cells, "something moves on the gel: keep everything off it");
  noise_levels = std::max(noise_levels, change);
  held.push_back(bgr.clone());
  if (held.size() >= kBackgroundFrames) take_background();
}

void PressCollector::Impl::take_background() {
  const cv::Mat3b mean = mean_image(held);
  const cv::Mat3f cells = shrink_to_cells(mean);
  held.clear();
  if (!options.any_background && stained_share(MarkerFiller(mean).background()) > kMaxBareStained) {
    status.warning = "something lies on the gel: lift it, so that the bare gel can be seen";
    return;
  }
  background = mean;
  bare_cells = cells;
  status = {CollectPhase::ready, "", std::nullopt};
}

/// Detects a change of light, such as a lamp that fails, after which no press would match the background.
void PressCollector::Impl::look_at_light(const cv::Mat3b& bgr) {
  const bool was_changed = std::exchange(light_changed, !shows_same_gel(bgr, background));
  if (light_changed)
    status.warning =
        "the light has changed over the gel since it was seen bare: nothing is taken until it is as it was; "
        "else begin again in another folder";
  else if (was_changed)
    status.warning.clear();
}

void PressCollector::Impl::begin_touch() {
  status = {CollectPhase::pressing, "", std::nullopt};
  held.clear();
  anchor.release();
  best.reset();
  places.clear();
  holds = 0;
}

std::optional<CollectedPress> PressCollector::Impl::end_touch() {
  const bool taken = best.has_value();
  std::string why;
  if (!taken)
    why =
        "not taken: " + (status.warning.empty() ? "the ball was not held still long enough" : status.warning);
  status = {CollectPhase::ready, why, std::nullopt};
  return std::exchange(best, std::nullopt);
}

bool PressCollector::Impl::slides(const ChangedPiece& piece) {
  places.push_back(piece);
  if (places.size() <= kSlideFrames) return false;
  const ChangedPiece before = places.front();
  places.pop_front();
  const double growth = static_cast<double>(piece.cells) / before.cells;
  return std::hypot(piece.u_cells - before.u_cells, piece.v_cells - before.v_cells) > kSlideCells &&
         growth < kSlideGrowth && growth > 1.0 / kSlideGrowth;
}

/// Judges a press that has been held still for kStillFrames frames.
void PressCollector::Impl::judge_hold() {
  const cv::Mat3b mean = mean_image(std::exchange(held, {}));
  cv::Mat1b covered;
  const MarkerFiller filler(background);
  const double too_wide_px =
      (kMaxOfBall * 0.5 * options.diameter_mm + kVisibleRimMm) / options.pixel_pitch_mm;
  const cv::Mat3b filled = filler.fill(mean, covered);
  const auto circle_of = [&](double diameter_mm) {
    return find_circle(filled, filler.background(),
                       CameraModel{mean.size(), options.pixel_pitch_mm, options.optics}, diameter_mm);
  };
  const FoundCircle found = circle_of(options.diameter_mm),
                    free = circle_of(kFlatterBall * options.diameter_mm);
  const bool is_clear = free.problem.empty() && !free.second_contact;
  const std::string problem =
      advice_about(found, is_clear ? free.circle : ContactCircle{}, mean.size(), too_wide_px);
  ++holds;
  if (best && (!problem.empty() || found.confidence <= best->confidence)) return;
  status.found.reset();
  if (found.confidence > 0.0) status.found = found.circle;
  status.warning = problem;
  if (problem.empty()) {
    best = CollectedPress{mean, found.circle, found.confidence};
    status.phase = CollectPhase::taken;
  } else if (holds >= kPatienceHolds) {
    status.warning += "; if nothing touches the gel, it was not bare at the start: begin again";
  }
}

std::optional<CollectedPress> PressCollector::Impl::watch(const cv::Mat3b& bgr, const cv::Mat3f& cells) {
  look_at_light(bgr);
  if (light_changed) return std::nullopt;
  const std::vector<ChangedPiece> pieces = changed_pieces(cell_difference(cells, bare_cells), touch_level());
  const bool was_touched = status.phase != CollectPhase::ready;
  if (pieces.empty() || pieces.front().cells < kMinTouchedCells) {
    return was_touched ? end_touch() : std::nullopt;
  }
  if (!was_touched) begin_touch();
  const bool sliding = slides(pieces.front());
  if (anchor.empty() || largest(cell_difference(cells, anchor)) > still_level()) {
    anchor = cells;
    held.clear();
    if (!best && sliding) status.warning = "the ball slides: lift it, and press straight down";
  }
  held.push_back(bgr.clone());
  if (held.size() >= kStillFrames) judge_hold();
  return std::nullopt;
}

PressCollector::PressCollector(const CollectorOptions& options) : impl_(std::make_unique<Impl>(options)) {}
PressCollector::~PressCollector() = default;

std::optional<CollectedPress> PressCollector::add(const cv::Mat3b& bgr) {
  if (bgr.cols < kCellsAcross || bgr.rows < 32)
    throw Error("pictures of " + size_text(bgr.cols, bgr.rows) +
                " are too small to calibrate with: at least 80x32");
  if (impl_->size.empty()) impl_->size = bgr.size();
  if (bgr.size() != impl_->size)
    throw Error("the picture is " + size_text(bgr.cols, bgr.rows) + " but the first ones were " +
                size_text(impl_->size.width, impl_->size.height) + ": all must come from one sensor");
  if (impl_->background.empty()) {
    impl_->look_at_bare_gel(bgr, shrink_to_cells(bgr));
    return std::nullopt;
  }
  const cv::Mat3b followed = in_light_of(impl_->background, bgr);
  return impl_->watch(followed, shrink_to_cells(followed));
}

std::optional<CollectedPress> PressCollector::finish() { return std::exchange(impl_->best, std::nullopt); }

const CollectorStatus& PressCollector::status() const { return impl_->status; }

const cv::Mat3b& PressCollector::background() const { return impl_->background; }

void PressCollector::set_background(const cv::Mat3b& background) {
  if (background.size() != impl_->background.size())
    throw Error("the background is " + size_text(background.cols, background.rows) +
                " but the pictures are " + size_text(impl_->background.cols, impl_->background.rows) +
                ": another sensor?");
  impl_->bare_cells = shrink_to_cells(in_light_of(background, impl_->background));
  impl_->background = background.clone();
}

}  // namespace gelslam
