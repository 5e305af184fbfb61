#include "presses/press_judge.hpp"

#include <algorithm>
#include <vector>

#include "judging/gel_change.hpp"

namespace gelslam::calibration::detail {
namespace {

// The contact is to be an eighth to a quarter of the picture wide; a person may miss that by a little.
constexpr double kLeastWidth = 1.0 / 9.0, kMostWidth = 1.0 / 3.4;
// Contact radius over the ball's: beyond it the gel's flanks are steeper than 53 degrees, and lamps no longer
// reach them.
constexpr double kMostOfBall = 0.8;
constexpr double kLeastInset =
    0.35;  // of the radius: how far inside the picture the ball's middle has to lie

double inset_px(const ContactCircle& circle, const cv::Size& size) {
  return std::min(
      {circle.u_px, circle.v_px, size.width - 1.0 - circle.u_px, size.height - 1.0 - circle.v_px});
}

std::string problem_with(const FoundCircle& found, const std::vector<ChangedPiece>& pieces,
                         const cv::Size& size, double ball_px) {
  constexpr const char* off_the_edge = "too near the edge of the gel: move the ball inward";
  if (pieces.empty()) return "too shallow: press a little deeper";
  if (found.second_contact) return "two things touch the gel: press with the ball alone";
  const double width = 2.0 * found.circle.radius_px / size.width;
  if (found.problem.empty() && inset_px(found.circle, size) < kLeastInset * found.circle.radius_px)
    return off_the_edge;
  if (found.ball.radius_px > kMostOfBall * ball_px)
    return "too deep, or a smaller ball than was said: press less deep, and check the diameter";
  if (found.problem.empty() && width > kMostWidth) return "too deep: press less deep";
  if (found.problem.empty() && width < kLeastWidth) return "too shallow: press a little deeper";
  if (found.problem.empty()) return "";
  return pieces.front().at_border ? std::string(off_the_edge) : found.problem;
}

}  // namespace

JudgedPress judge_press(const cv::Mat3b& bgr, const cv::Mat3b& background, const cv::Mat1f& difference,
                        double touch_level, double ball_px) {
  JudgedPress judged{find_circle(bgr, background, ball_px), ""};
  const double level = level_of_contact(difference, touch_level);
  judged.problem = problem_with(judged.found, changed_pieces(difference, level), bgr.size(), ball_px);
  return judged;
}

}  // namespace gelslam::calibration::detail
