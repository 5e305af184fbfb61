#include "presses/second_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gelslam::calibration::detail {
namespace {

constexpr double contact_share = 0.3;  // of the largest difference
constexpr int least_second_cells = 6;
constexpr double least_second_weight = 0.15, second_beyond_radii = 1.6, second_beyond_unknown = 2.5;

}  // namespace

double level_of_contact(const cv::Mat1f& difference, double touch_level) {
  return std::max(touch_level, contact_share * largest(difference));
}

bool has_second_contact(const std::vector<ChangedPiece>& pieces, const FoundCircle& found, double cell_px) {
  const bool known = found.problem.empty();
  // Of two balls, the circle may have been found around the one that is not the heaviest piece.
  for (std::size_t k = known ? 0 : 1; k < pieces.size(); ++k) {
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

}  // namespace gelslam::calibration::detail
