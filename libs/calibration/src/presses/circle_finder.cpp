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

constexpr double kSeedShare = 0.12;  // of the strongest change: rim and sides that change little belong to it
constexpr int kMinSeedCells = 4;
constexpr double kWantedPoints = 1800, kWantedPointsToRefine = 900;

constexpr double kMaxRefined = 0.25;  // of the radius: further away, the finer fit has lost the contact

constexpr double kWantedPointsToSmear = 250, kFirstDecayPx = 8.0;
// Over the cost of a ball at rest. The least of 275 good presses was 0.61; 25 of 30 balls that slid by 1.4
// radii stay below this.
constexpr double kSlidCost = 0.58;
constexpr double kMinMoved = 0.5;  // of the radius: less does no harm inside the zone

constexpr double kContactShare = 0.3;  // of the strongest change: contacts without their rims
// Another contact: this many cells, this share of the first one's weight, this many radii from it.
constexpr int kMinSecondCells = 6;
constexpr double kMinSecondWeight = 0.15, kSecondBeyondRadii = 1.6;

constexpr double kMinRadiusPx = 6.0;
constexpr double kMinConfidence = 0.55;
constexpr double kMaxBallShare = 0.95;  // of the ball's radius: no gel is that deep

/// The heaviest piece of the picture that changed, its membrane rim included. `difference`: of cells.
std::optional<ContactCircle> find_seed(const cv::Mat1f& difference, double cell_px) {
  const double level = std::max(kMinTouchLevels, kSeedShare * largest(difference));
  const std::vector<ChangedPiece> pieces = changed_pieces(difference, level);
  if (pieces.empty() || pieces.front().cells < kMinSeedCells) return std::nullopt;
  const ChangedPiece& heaviest = pieces.front();
  return ContactCircle{(heaviest.u_cells + 0.5) * cell_px - 0.5, (heaviest.v_cells + 0.5) * cell_px - 0.5,
                       std::sqrt(heaviest.cells / std::numbers::pi) * cell_px};
}

/// A circle of the picture as one of the rectified grid.
PressShape shape_at(const CameraModel& camera, const ContactCircle& circle, double radius_px) {
  const Eigen::Vector2d raw_px(circle.u_px, circle.v_px);
  if (!camera.optics.has_lens()) return {raw_px.x(), raw_px.y(), radius_px, kFirstDecayPx};
  const Eigen::Vector2d px = camera.rectified_px(raw_px);
  return {px.x(), px.y(), rest_px_per_raw_px(camera, raw_px) * radius_px, kFirstDecayPx};
}

/// And back; the disc that people see.
ContactCircle circle_at(const CameraModel& camera, const PressShape& shape) {
  const Eigen::Vector2d px(shape.u_px, shape.v_px);
  const Eigen::Vector2d raw_px = camera.optics.has_lens() ? camera.raw_px(px).value_or(px) : px;
  const double scale = camera.optics.has_lens() ? rest_px_per_raw_px(camera, raw_px) : 1.0;
  return {raw_px.x(), raw_px.y(), shape.radius_px / scale + kVisibleRimMm / camera.pitch_mm};
}

PressFit fit_from(const ContactCircle& seed, const cv::Mat3f& relative, const CameraModel& camera,
                  double ball_px) {
  const PressPoints points = points_around(seed, relative, camera, kWantedPoints);
  constexpr double knee_share = 0.75;  // of the piece that changed
  PressShape start = shape_at(camera, seed, knee_share * seed.radius_px);
  start.radius_px = std::min(start.radius_px, 0.9 * ball_px);
  return fit_press(points, start, ball_px);
}

/// A better center, and where the gel leaves the ball.
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

/// A ball that moved explains far more of the picture than one at rest.
bool slid(const ContactCircle& circle, const cv::Mat3f& relative, const CameraModel& camera, double ball_px) {
  const PressPoints points = points_around(circle, relative, camera, kWantedPointsToSmear);
  const PressShape start = shape_at(camera, circle, circle.on_ball_px(camera.pitch_mm));
  const SlidPress fit = fit_slid_press(points, start, ball_px);
  return fit.moved_px > kMinMoved * fit.radius_px &&
         fit.cost < kSlidCost * fit_press(points, start, ball_px).cost;
}

/// Two balls, or a finger beside one. `first`: the contact that is known, the more exactly the better.
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
