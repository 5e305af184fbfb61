#include "presses/second_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gelslam::calibration::detail {
namespace {

constexpr double kContactShare = 0.3;  // of the largest difference
constexpr int kLeastSecondCells = 6;
constexpr double kLeastSecondWeight = 0.15, kSecondBeyondRadii = 1.6, kSecondBeyondUnknown = 2.5;

}  // namespace

double level_of_contact(const cv::Mat1f& difference, double touch_level) {
  return std::max(touch_level, kContactShare * largest(difference));
}

bool has_second_contact(const std::vector<ChangedPiece>& pieces, const FoundCircle& found, double cell_px) {
  const bool known = found.problem.empty();
  // Of two balls, the circle may have been found around the one that is not the heaviest piece.
  for (std::size_t k = known ? 0 : 1; k < pieces.size(); ++k) {
    const ChangedPiece& piece = pieces[k];
    if (piece.cells < kLeastSecondCells || piece.weight < kLeastSecondWeight * pieces.front().weight)
      continue;
    const double u = known ? found.circle.u_px / cell_px : pieces.front().u_cells,
                 v = known ? found.circle.v_px / cell_px : pieces.front().v_cells,
                 reach = known ? kSecondBeyondRadii * found.circle.radius_px / cell_px
                               : kSecondBeyondUnknown * std::sqrt(pieces.front().cells / std::numbers::pi);
    if (std::hypot(piece.u_cells - u, piece.v_cells - v) > reach) return true;
  }
  return false;
}

}  // namespace gelslam::calibration::detail
