#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// Finds pictures that came shifted sideways, whole or from some row on, as a camera's fault on USB leaves
/// them (own): their bare gel looks like the background's elsewhere in the row.
class ShiftFinder {
 public:
  /// Block means, as all later pictures'.
  explicit ShiftFinder(const cv::Mat3f& background_blocks);
  /// Of block means in the background's light: by how many pixels to the right; 0 where the picture lies as
  /// the background, or does not show how.
  int find_px(const cv::Mat3f& blocks);

 private:
  std::vector<cv::Mat3f> shifted_;  // the background, not at all first
  std::vector<int> shift_blocks_;
  cv::Mat1b bare_;  // cells that agreed with the background in the last picture that was not shifted
};

}  // namespace gelslam::surface::detail
