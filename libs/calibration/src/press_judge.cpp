#include "press_judge.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gel_change.hpp"

namespace gelslam::calibration::detail {
namespace {

// The contact is to be an eighth to a quarter of the picture wide; a person may miss that by a little.
constexpr double least_width = 1.0 / 9.0, most_width = 1.0 / 3.4;
// Contact radius over the ball's: beyond it the gel's flanks are steeper than 53 degrees, and lamps no longer
// reach them.
constexpr double most_of_ball = 0.8;
constexpr double least_inset =
    0.35;  // of the radius: how far inside the picture the ball's middle has to lie
constexpr double contact_share = 0.3;  // of the largest difference
constexpr int least_second_cells = 6;
constexpr double least_second_weight = 0.15, second_beyond_radii = 1.6, second_beyond_unknown = 2.5;

bool has_second_contact(const std::vector<ChangedPiece>& pieces, const FoundCircle& found, double cell_px) {
  const bool known = found.problem.empty();
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    const ChangedPiece& piece = pieces[k];
    if (piece.cells < least_second_cells || piece.weight < least_second_weight * pieces.front().weight)
      continue;
    const double u = known ? found.circle.u_px / cell_px : pieces.front().u_cells,
                 v = known ? found.circle.v_px / cell_px : pieces.front().v_cells,
                 reach = known ? second_beyond_radii * found.circle.radius_px / cell_px
                               : second_beyond_unknown * std::sqrt(pieces.front().cells / std::numbers::pi);
    if (std::hypot(piece.u_cells - u, piece.v_cells - v) > reach) return true;
  }
  return false;
}

double inset_px(const ContactCircle& circle, const cv::Size& size) {
  return std::min(
      {circle.u_px, circle.v_px, size.width - 1.0 - circle.u_px, size.height - 1.0 - circle.v_px});
}

std::string problem_with(const FoundCircle& found, const std::vector<ChangedPiece>& pieces,
                         const cv::Size& size, double cell_px, double ball_px) {
  constexpr const char* off_the_edge = "too near the edge of the gel: move the ball inward";
  if (pieces.empty()) return "too shallow: press a little deeper";
  if (has_second_contact(pieces, found, cell_px))
    return "two things touch the gel: press with the ball alone";
  const double width = 2.0 * found.circle.radius_px / size.width;
  if (found.problem.empty() && inset_px(found.circle, size) < least_inset * found.circle.radius_px)
    return off_the_edge;
  if (found.ball.radius_px > most_of_ball * ball_px)
    return "too deep, or a smaller ball than was said: press less deep, and check the diameter";
  if (found.problem.empty() && width > most_width) return "too deep: press less deep";
  if (found.problem.empty() && width < least_width) return "too shallow: press a little deeper";
  if (found.problem.empty()) return "";
  return pieces.front().at_border ? std::string(off_the_edge) : found.problem;
}

}  // namespace

JudgedPress judge_press(const cv::Mat3b& bgr, const cv::Mat3b& background, const cv::Mat1f& difference,
                        double touch_level, double ball_px) {
  const double level = std::max(touch_level, contact_share * largest(difference));
  JudgedPress judged{find_circle(bgr, background, ball_px), ""};
  judged.problem = problem_with(judged.found, changed_pieces(difference, level), bgr.size(),
                                static_cast<double>(bgr.cols) / cells_across, ball_px);
  return judged;
}

}  // namespace gelslam::calibration::detail
