// Finds the contact circle of a ball in an image (not in the paper).
//
// The largest connected region that changed gives a first circle. From there the shape of the press is fitted
// to the relative color change (press_fit.cpp), first with a color function of degree 2 and then with one of
// degree 4 for a more accurate center. The result is rejected if the fit explains too little of the change,
// if the circle is too small, too large for the ball or outside the image, if there is a second contact, or
// if a model of a sliding ball fits much better.

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

// Relative to the strongest change. The level is low because the rim and some flanks change little.
constexpr double kSeedShare = 0.12;
constexpr int kMinSeedCells = 4;
constexpr double kWantedPoints = 1800, kWantedPointsToRefine = 900;

// Relative to the radius. If the center moves further, the second fit has lost the contact.
constexpr double kMaxRefined = 0.25;

constexpr double kWantedPointsToSmear = 250, kFirstDecayPx = 8.0;
// Cost of the fit of a sliding ball relative to that of a ball at rest, below which the ball slid. The
// smallest ratio of 275 good presses was 0.61; of 30 balls that slid by 1.4 radii, 25 are below 0.58.
constexpr double kSlidCost = 0.58;
// Relative to the radius. A smaller movement does no harm inside the zone.
constexpr double kMinMoved = 0.5;

// Relative to the strongest change. At this level contacts appear without their rims.
constexpr double kContactShare = 0.3;
// A second contact has at least this many cells, this fraction of the first one's weight, and is this many
// radii away from it.
constexpr int kMinSecondCells = 6;
constexpr double kMinSecondWeight = 0.15, kSecondBeyondRadii = 1.6;

constexpr double kMinRadiusPx = 6.0;
constexpr double kMinConfidence = 0.55;
// Relative to the ball's radius. No gel can be pressed in that deep.
constexpr double kMaxBallShare = 0.95;

/// Returns a circle around the changed region with the largest weight, including the rim of the membrane.
/// `difference` is given per cell.
std::optional<ContactCircle> find_seed(const cv::Mat1f& difference, double cell_px) {
  const double level = std::max(kMinTouchLevels, kSeedShare * largest(difference));
  const std::vector<ChangedPiece> pieces = changed_pieces(difference, level);
  if (pieces.empty() || pieces.front().cells < kMinSeedCells) return std::nullopt;
  const ChangedPiece& heaviest = pieces.front();
  return ContactCircle{(heaviest.u_cells + 0.5) * cell_px - 0.5, (heaviest.v_cells + 0.5) * cell_px - 0.5,
                       std::sqrt(heaviest.cells / std::numbers::pi) * cell_px};
}

/// Converts a circle of the image to the rectified grid.
PressShape shape_at(const CameraModel& camera, const ContactCircle& circle, double radius_px) {
  const Eigen::Vector2d raw_px(circle.u_px, circle.v_px);
  if (!camera.optics.has_lens()) return {raw_px.x(), raw_px.y(), radius_px, kFirstDecayPx};
  const Eigen::Vector2d px = camera.rectified_px(raw_px);
  return {px.x(), px.y(), rest_px_per_raw_px(camera, raw_px) * radius_px, kFirstDecayPx};
}

/// Converts a shape back to a circle of the image, with the radius of the visible disk.
ContactCircle circle_at(const CameraModel& camera, const PressShape& shape) {
  const Eigen::Vector2d px(shape.u_px, shape.v_px);
  const Eigen::Vector2d raw_px = camera.optics.has_lens() ? camera.raw_px(px).value_or(px) : px;
  const double scale = camera.optics.has_lens() ? rest_px_per_raw_px(camera, raw_px) : 1.0;
  return {raw_px.x(), raw_px.y(), shape.radius_px / scale + kVisibleRimMm / camera.pitch_mm};
}

PressFit fit_from(const ContactCircle& seed, const cv::Mat3f& relative, const CameraModel& camera,
                  double ball_px) {
  const PressPoints points = points_around(seed, relative, camera, kWantedPoints);
  constexpr double knee_share = 0.75;  // Radius of the contact relative to that of the changed region.
  PressShape start = shape_at(camera, seed, knee_share * seed.radius_px);
  start.radius_px = std::min(start.radius_px, 0.9 * ball_px);
  return fit_press(points, start, ball_px);
}

/// Returns a more accurate center, and the radius at which the gel leaves the ball.
PressShape refined(const PressShape& shape, const cv::Mat3f& relative, const CameraModel& camera,
                   double ball_px) {
  ContactCircle contact = circle_at(camera, shape);
  contact.radius_px = contact.on_ball_px(camera.pitch_mm);
  const PressPoints points = points_around(contact, relative, camera, kWantedPointsToRefine);
  const PressShape ball = refine_press(points, shape, ball_px).shape;
  const double moved_px = std::hypot(ball.u_px - shape.u_px, ball.v_px - shape.v_px);
  return moved_px < kMaxRefined * shape.radius_px ? ball : shape;
}

std::string problem_with(const FoundCircle& found, const CameraModel& camera, double ball_px) {
  const cv::Size size = camera.size;
  const double on_ball_px = found.circle.on_ball_px(camera.pitch_mm);
  if (found.confidence < kMinConfidence) return "the colors do not look like a ball pressed into the gel";
  if (on_ball_px < kMinRadiusPx) return "the contact is too small";
  if (on_ball_px > kMaxBallShare * ball_px)
    return "the contact is larger than the ball: is the diameter right?";
  if (found.circle.u_px < 0.0 || found.circle.v_px < 0.0 || found.circle.u_px > size.width - 1.0 ||
      found.circle.v_px > size.height - 1.0)
    return "the ball's middle lies outside the picture";
  return "";
}

/// Says whether the ball slid: a model of a moving ball explains far more of the image than one at rest.
bool slid(const ContactCircle& circle, const cv::Mat3f& relative, const CameraModel& camera, double ball_px) {
  const PressPoints points = points_around(circle, relative, camera, kWantedPointsToSmear);
  const PressShape start = shape_at(camera, circle, circle.on_ball_px(camera.pitch_mm));
  const SlidPress fit = fit_slid_press(points, start, ball_px);
  return fit.moved_px > kMinMoved * fit.radius_px &&
         fit.cost < kSlidCost * fit_press(points, start, ball_px).cost;
}

/// Says whether there is a second contact, such as another ball or a finger. `first` is the known contact.
bool has_second_contact(const ContactCircle& first, const cv::Mat1f& difference, double cell_px) {
  const std::vector<ChangedPiece> pieces =
      changed_pieces(difference, std::max(kMinTouchLevels, kContactShare * largest(difference)));
  return std::ranges::any_of(pieces, [&](const ChangedPiece& piece) {
    return piece.cells >= kMinSecondCells && piece.weight >= kMinSecondWeight * pieces.front().weight &&
           std::hypot(piece.u_cells * cell_px - first.u_px, piece.v_cells * cell_px - first.v_px) >
               kSecondBeyondRadii * first.radius_px;
  });
}

}  // namespace

double rest_px_per_raw_px(const CameraModel& camera, const Eigen::Vector2d& raw_px) {
  const auto step = [&](const Eigen::Vector2d& half) -> Eigen::Vector2d {
    return camera.rectified_px(raw_px + half) - camera.rectified_px(raw_px - half);
  };
  const Eigen::Vector2d x = step({0.5, 0.0}), y = step({0.0, 0.5});
  return std::sqrt(std::abs(x.x() * y.y() - x.y() * y.x()));
}

FoundCircle find_circle(const cv::Mat3b& bgr, const cv::Mat3b& background, const CameraModel& camera,
                        double diameter_mm) {
  const double ball_px = 0.5 * diameter_mm / camera.pitch_mm;
  FoundCircle found;
  const cv::Mat1f difference = cell_difference(shrink_to_cells(bgr), shrink_to_cells(background));
  const double cell_px = static_cast<double>(bgr.cols) / kCellsAcross;
  const std::optional<ContactCircle> seed = find_seed(difference, cell_px);
  if (!seed) {
    found.problem = "nothing touches the gel";
    return found;
  }
  const cv::Mat3f relative = relative_change(bgr, background);
  const PressFit fit = fit_from(*seed, relative, camera, ball_px);
  const PressShape ball = refined(fit.shape, relative, camera, ball_px);
  found.circle = circle_at(camera, ball);
  found.confidence = fit.explained;
  found.problem = problem_with(found, camera, ball_px);
  found.second_contact =
      has_second_contact(found.problem.empty() ? found.circle : *seed, difference, cell_px);
  if (found.problem.empty() && found.second_contact) found.problem = "two things touch the gel";
  if (found.problem.empty() && slid(found.circle, relative, camera, ball_px))
    found.problem = "the ball slid while the picture was taken";
  return found;
}

}  // namespace gelslam
