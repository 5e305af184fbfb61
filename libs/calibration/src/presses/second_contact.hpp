#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/calibration/circle_finder.hpp"
#include "judging/gel_change.hpp"

namespace gelslam::calibration::detail {

/// True when something touches the gel beside the contact. `pieces`: changed_pieces() of the difference to
/// the bare gel.
bool has_second_contact(const std::vector<ChangedPiece>& pieces, const FoundCircle& found, double cell_px);

/// The largest level at which a touch is seen whole: a share of the strongest difference.
double level_of_contact(const cv::Mat1f& difference, double touch_level);

inline constexpr double kLeastTouchLevels = 5.0;  ///< of cells, where noise is below one

}  // namespace gelslam::calibration::detail
