#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/slam/live_session.hpp"

namespace gelslam::viewer::detail {

/// 1, 2 or 5 times a power of ten that nearly all of the distances are below; 1 without any.
float round_limit_mm(std::vector<float> distance_mm);

/// How much a keyframe's place is in doubt, in red, by id along rows of kDoubtColumns: 0 where two standard
/// deviations are `from_mm`, 255 where they are `to_mm`.
cv::Mat4b doubt_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm);
inline constexpr int kDoubtColumns = 256;

}  // namespace gelslam::viewer::detail
