#include "gelslam/calibration/circle_finder.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "gelslam/calibration/press_change.hpp"
#include "judging/gel_change.hpp"
#include "presses/press_points.hpp"
#include "presses/second_contact.hpp"
#include "presses/visible_rim.hpp"
#include "training/press_fit.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr float seed_share = 0.3F;  // of the strongest change: what belongs to the contact at first sight
constexpr float wide_share =
    0.12F;  // and at second sight, with its membrane rim and the sides that change little
constexpr double least_of_wide =
    0.5;  // a circle smaller than this share of the wide piece is a part of the contact
constexpr float min_seed_levels = 6.0F;
constexpr int min_seed_pixels = 60;
constexpr double wanted_points = 1800, wanted_points_to_refine = 900;

constexpr double most_refined = 0.25;  // of the radius: further away, the finer fit has lost the contact

constexpr double wanted_points_to_smear = 250, first_decay_px = 8.0;
// Over the cost of even blur. The least of 366 good presses was 0.79; of 10 balls that slid by 2 mm, 0.44 to
// 0.72.
constexpr double slid_cost = 0.7;
constexpr double least_moved = 0.5;  // of the radius: less does no harm inside the zone

constexpr double min_radius_px = 6.0;
constexpr double min_confidence = 0.55;
constexpr double max_ball_share = 0.95;     // of the ball's radius: no gel is that deep
constexpr double min_visible_share = 0.35;  // of the circle inside the picture

struct Seed {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
};

/// The heaviest connected piece of the picture that changed by more than `threshold`.
std::optional<Seed> heaviest_piece(const cv::Mat1f& strength, float threshold) {
  cv::Mat1i labels;
  cv::Mat1i stats;
  cv::Mat1d centers;
  const int pieces =
      cv::connectedComponentsWithStats(strength > threshold, labels, stats, centers, 8, CV_32S);
  std::vector<double> weights(static_cast<std::size_t>(pieces), 0.0);
  for (int v = 0; v < labels.rows; ++v)
    for (int u = 0; u < labels.cols; ++u)
      if (labels(v, u) > 0)
        weights[static_cast<std::size_t>(labels(v, u))] += static_cast<double>(strength(v, u));
  const auto heaviest = static_cast<int>(std::max_element(weights.begin(), weights.end()) - weights.begin());
  if (heaviest == 0 || stats(heaviest, cv::CC_STAT_AREA) < min_seed_pixels) return std::nullopt;
  return Seed{centers(heaviest, 0), centers(heaviest, 1),
              std::sqrt(stats(heaviest, cv::CC_STAT_AREA) / 3.14159265)};
}

/// The place that changed most, seen narrowly and widely.
struct Seeds {
  std::optional<Seed> narrow, wide;
};

Seeds find_seeds(const cv::Mat3f& change) {
  cv::Mat3f smooth;
  cv::GaussianBlur(change, smooth, cv::Size(), 2.0);
  cv::Mat1f strength(smooth.size());
  std::transform(smooth.begin(), smooth.end(), strength.begin(),
                 [](const cv::Vec3f& c) { return static_cast<float>(cv::norm(c)); });
  std::vector<float> sorted(strength.begin(), strength.end());
  const auto strongest =
      sorted.end() - static_cast<std::ptrdiff_t>(std::max<std::size_t>(1, sorted.size() / 200));
  std::nth_element(sorted.begin(), strongest, sorted.end());
  const auto piece_above = [&](float share) {
    return heaviest_piece(strength, std::max(min_seed_levels, share * *strongest));
  };
  return {piece_above(seed_share), piece_above(wide_share)};
}

PressFit fit_from(const Seed& seed, const cv::Mat3f& relative, double ball_px) {
  const PressPoints points = points_around({seed.u_px, seed.v_px, seed.radius_px}, relative, wanted_points);
  std::optional<PressFit> best;
  for (const double share : {0.75, 1.0}) {
    const PressShape start{seed.u_px, seed.v_px, std::min(share * seed.radius_px, 0.9 * ball_px),
                           first_decay_px};
    const PressFit fit = fit_press(points, start, ball_px);
    if (!best || fit.cost < best->cost) best = fit;
  }
  return *best;
}

/// In a dim corner the strongest change can be a piece of the membrane rim; a small circle then explains that
/// piece alone.
PressFit fit_contact(const Seeds& seeds, const cv::Mat3f& relative, double ball_px) {
  const PressFit fit = fit_from(*seeds.narrow, relative, ball_px);
  if (!seeds.wide || fit.shape.radius_px > least_of_wide * seeds.wide->radius_px) return fit;
  return fit_from(*seeds.wide, relative, ball_px);
}

/// The ball itself: its center, and where the gel leaves it.
ContactCircle refined(const PressShape& shape, const cv::Mat3f& relative, double ball_px) {
  const ContactCircle around{shape.u_px, shape.v_px, shape.radius_px};
  const PressShape ball =
      refine_press(points_around(around, relative, wanted_points_to_refine), shape, ball_px).shape;
  const bool near =
      std::hypot(ball.u_px - shape.u_px, ball.v_px - shape.v_px) < most_refined * shape.radius_px;
  return near ? ContactCircle{ball.u_px, ball.v_px, ball.radius_px} : around;
}

/// Share of the circle that lies in the picture.
double visible_share(const ContactCircle& circle, const cv::Size& size) {
  constexpr int steps = 720;
  int inside = 0;
  for (int k = 0; k < steps; ++k) {
    const double angle = 2.0 * 3.14159265358979 * k / steps;
    const double u = circle.u_px + circle.radius_px * std::cos(angle),
                 v = circle.v_px + circle.radius_px * std::sin(angle);
    if (u > -0.5 && v > -0.5 && u < size.width - 0.5 && v < size.height - 0.5) ++inside;
  }
  return static_cast<double>(inside) / steps;
}

std::string problem_with(const FoundCircle& found, const cv::Size& size, double ball_px) {
  if (found.confidence < min_confidence) return "the colors do not look like a ball pressed into the gel";
  if (found.ball.radius_px < min_radius_px) return "the contact is too small";
  if (found.ball.radius_px > max_ball_share * ball_px)
    return "the contact is larger than the ball: is the diameter right?";
  if (found.circle.u_px < 0.0 || found.circle.v_px < 0.0 || found.circle.u_px > size.width - 1.0 ||
      found.circle.v_px > size.height - 1.0)
    return "the ball's middle lies outside the picture";
  if (visible_share(found.circle, size) < min_visible_share)
    return "most of the contact lies outside the picture";
  return "";
}

/// Blur in one direction tells far more of the picture than blur in all.
bool slid(const FoundCircle& found, const cv::Mat3f& relative, double ball_px) {
  const PressPoints points = points_around(found.circle, relative, wanted_points_to_smear);
  const PressShape start{found.ball.u_px, found.ball.v_px, found.ball.radius_px, first_decay_px};
  const SlidPress fit = fit_slid_press(points, start, ball_px);
  return fit.moved_px > least_moved * fit.radius_px &&
         fit.cost < slid_cost * blurred_cost(points, start, ball_px);
}

/// Two balls, or a finger beside one: the membrane rims of both lie on each other.
bool touches_twice(const FoundCircle& found, const cv::Mat3b& bgr, const cv::Mat3b& background) {
  const cv::Mat1f difference = cell_difference(shrink_to_cells(bgr), shrink_to_cells(background));
  return has_second_contact(changed_pieces(difference, level_of_contact(difference, least_touch_levels)),
                            found, static_cast<double>(bgr.cols) / cells_across);
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
                     .value_or(ContactCircle{knee.u_px, knee.v_px, knee.radius_px + visible_rim_px});
  found.confidence = fit.explained;
  found.problem = problem_with(found, bgr.size(), ball_px);
  if (found.problem.empty() && touches_twice(found, bgr, background))
    found.problem = "two things touch the gel";
  if (found.problem.empty() && slid(found, relative, ball_px))
    found.problem = "the ball slid while the picture was taken";
  return found;
}

}  // namespace gelslam
