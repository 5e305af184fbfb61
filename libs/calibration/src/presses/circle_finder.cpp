#include "gelslam/calibration/circle_finder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "gelslam/core/median.hpp"
#include "judging/gel_change.hpp"
#include "presses/press_fit.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr float kSeedShare = 0.3F;  // of the strongest change: what belongs to the contact at first sight
constexpr float kWideShare =
    0.12F;  // and at second sight, with its membrane rim and the sides that change little
constexpr double kMinOfWide =
    0.5;  // a circle smaller than this share of the wide piece is a part of the contact
constexpr double kStrongestShare = 0.995;  // of the pixels change less than the strongest
constexpr float kMinSeedLevels = 6.0F;
constexpr int kMinSeedPixels = 60;
constexpr double kWantedPoints = 1800, kWantedPointsToRefine = 900;

constexpr double kMaxRefined = 0.25;  // of the radius: further away, the finer fit has lost the contact

constexpr double kWantedPointsToSmear = 250, kFirstDecayPx = 8.0;
// Over the cost of a ball at rest. The least of 275 good presses was 0.61; of 14 balls that slid by 1.4
// radii, 0.24 to 0.57.
constexpr double kSlidCost = 0.58;
constexpr double kMinMoved = 0.5;  // of the radius: less does no harm inside the zone

// Another contact: this many cells, this share of the first one's weight, this far from it (in radii of the
// circle, or of the heaviest piece where no circle is known).
constexpr int kMinSecondCells = 6;
constexpr double kMinSecondWeight = 0.15, kSecondBeyondRadii = 1.6, kSecondBeyondUnknown = 2.5;

constexpr double kMinRadiusPx = 6.0;
constexpr double kMinConfidence = 0.55;
constexpr double kMaxBallShare = 0.95;     // of the ball's radius: no gel is that deep
constexpr double kMinVisibleShare = 0.35;  // of the circle inside the picture

struct Seed {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
};

/// The heaviest connected piece of the picture that changed by more than `threshold`.
std::optional<Seed> heaviest_piece(const cv::Mat1f& strength, double threshold) {
  const std::vector<ChangedPiece> pieces = changed_pieces(strength, threshold);
  if (pieces.empty() || pieces.front().cells < kMinSeedPixels) return std::nullopt;
  const ChangedPiece& heaviest = pieces.front();
  return Seed{heaviest.u_cells, heaviest.v_cells, std::sqrt(heaviest.cells / std::numbers::pi)};
}

/// The place that changed most, seen narrowly and widely.
struct Seeds {
  std::optional<Seed> narrow, wide;
};

Seeds find_seeds(const cv::Mat3f& change) {
  cv::Mat3f smooth;
  cv::GaussianBlur(change, smooth, cv::Size(), 2.0);
  const cv::Mat1f strength = length_of(smooth);
  std::vector<float> strengths(strength.begin(), strength.end());
  const float strongest = quantile_in_place(strengths, kStrongestShare);
  const auto piece_above = [&](float share) {
    return heaviest_piece(strength, static_cast<double>(std::max(kMinSeedLevels, share * strongest)));
  };
  return {piece_above(kSeedShare), piece_above(kWideShare)};
}

PressFit fit_from(const Seed& seed, const cv::Mat3f& relative, double ball_px) {
  const PressPoints points = points_around({seed.u_px, seed.v_px, seed.radius_px}, relative, kWantedPoints);
  constexpr double knee_share = 0.75;  // of the piece that changed
  return fit_press(
      points, {seed.u_px, seed.v_px, std::min(knee_share * seed.radius_px, 0.9 * ball_px), kFirstDecayPx},
      ball_px);
}

/// In a dim corner the strongest change can be a piece of the membrane rim; a small circle then explains that
/// piece alone.
PressFit fit_contact(const Seeds& seeds, const cv::Mat3f& relative, double ball_px) {
  const PressFit fit = fit_from(*seeds.narrow, relative, ball_px);
  if (!seeds.wide || fit.shape.radius_px > kMinOfWide * seeds.wide->radius_px) return fit;
  return fit_from(*seeds.wide, relative, ball_px);
}

/// The ball itself: its center, and where the gel leaves it.
ContactCircle refined(const PressShape& shape, const cv::Mat3f& relative, double ball_px) {
  const ContactCircle around{shape.u_px, shape.v_px, shape.radius_px};
  const PressShape ball =
      refine_press(points_around(around, relative, kWantedPointsToRefine), shape, ball_px).shape;
  const bool near =
      std::hypot(ball.u_px - shape.u_px, ball.v_px - shape.v_px) < kMaxRefined * shape.radius_px;
  return near ? ContactCircle{ball.u_px, ball.v_px, ball.radius_px} : around;
}

/// Share of the circle that lies in the picture.
double visible_share(const ContactCircle& circle, const cv::Size& size) {
  constexpr int steps = 720;
  int inside = 0;
  for (int k = 0; k < steps; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / steps;
    const double u = circle.u_px + circle.radius_px * std::cos(angle),
                 v = circle.v_px + circle.radius_px * std::sin(angle);
    if (u > -0.5 && v > -0.5 && u < size.width - 0.5 && v < size.height - 0.5) ++inside;
  }
  return static_cast<double>(inside) / steps;
}

std::string problem_with(const FoundCircle& found, const cv::Size& size, double ball_px) {
  if (found.confidence < kMinConfidence) return "the colors do not look like a ball pressed into the gel";
  if (found.ball.radius_px < kMinRadiusPx) return "the contact is too small";
  if (found.ball.radius_px > kMaxBallShare * ball_px)
    return "the contact is larger than the ball: is the diameter right?";
  if (found.circle.u_px < 0.0 || found.circle.v_px < 0.0 || found.circle.u_px > size.width - 1.0 ||
      found.circle.v_px > size.height - 1.0)
    return "the ball's middle lies outside the picture";
  if (visible_share(found.circle, size) < kMinVisibleShare)
    return "most of the contact lies outside the picture";
  return "";
}

/// A ball that moved explains far more of the picture than one at rest.
bool slid(const FoundCircle& found, const cv::Mat3f& relative, double ball_px) {
  const PressPoints points = points_around(found.circle, relative, kWantedPointsToSmear);
  const PressShape start{found.ball.u_px, found.ball.v_px, found.ball.radius_px, kFirstDecayPx};
  const SlidPress fit = fit_slid_press(points, start, ball_px);
  return fit.moved_px > kMinMoved * fit.radius_px &&
         fit.cost < kSlidCost * fit_press(points, start, ball_px).cost;
}

/// Two balls, or a finger beside one.
bool has_second_contact(const FoundCircle& found, const cv::Mat3b& bgr, const cv::Mat3b& background) {
  const cv::Mat1f difference = cell_difference(shrink_to_cells(bgr), shrink_to_cells(background));
  const std::vector<ChangedPiece> pieces =
      changed_pieces(difference, level_of_contact(difference, kMinTouchLevels));
  const double cell_px = static_cast<double>(bgr.cols) / kCellsAcross;
  const bool known = found.problem.empty();
  // The circle of two balls may have been found around the one that is not the heaviest piece.
  for (std::size_t k = known ? 0 : 1; k < pieces.size(); ++k) {
    const ChangedPiece& piece = pieces[k];
    if (piece.cells < kMinSecondCells || piece.weight < kMinSecondWeight * pieces.front().weight) continue;
    const double u = known ? found.circle.u_px / cell_px : pieces.front().u_cells,
                 v = known ? found.circle.v_px / cell_px : pieces.front().v_cells,
                 reach = known ? kSecondBeyondRadii * found.circle.radius_px / cell_px
                               : kSecondBeyondUnknown * std::sqrt(pieces.front().cells / std::numbers::pi);
    if (std::hypot(piece.u_cells - u, piece.v_cells - v) > reach) return true;
  }
  return false;
}

}  // namespace

FoundCircle find_circle(const cv::Mat3b& bgr, const cv::Mat3b& background, double ball_px) {
  FoundCircle found;
  const cv::Mat3f change = press_change(bgr, background);
  const Seeds seeds = find_seeds(change);
  if (!seeds.narrow) {
    found.problem = "nothing touches the gel";
    return found;
  }
  const cv::Mat3f relative = relative_change(change, background);
  const PressFit fit = fit_contact(seeds, relative, ball_px);
  found.ball = refined(fit.shape, relative, ball_px);
  const ContactCircle knee{fit.shape.u_px, fit.shape.v_px, fit.shape.radius_px};
  found.circle = find_visible_rim(relative, knee)
                     .value_or(ContactCircle{knee.u_px, knee.v_px, knee.radius_px + kVisibleRimPx});
  found.confidence = fit.explained;
  found.problem = problem_with(found, bgr.size(), ball_px);
  found.second_contact = has_second_contact(found, bgr, background);
  if (found.problem.empty() && found.second_contact) found.problem = "two things touch the gel";
  if (found.problem.empty() && slid(found, relative, ball_px))
    found.problem = "the ball slid while the picture was taken";
  return found;
}

}  // namespace gelslam
