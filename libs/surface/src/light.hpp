#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// How the lamps and stray light differ from when the background was taken: per channel, seen = gain * then +
/// offset. Untouched gel keeps its colour otherwise, so both follow from the untouched part of one frame.
struct Light {
  std::array<double, 3> gain{1.0, 1.0, 1.0};
  std::array<double, 3> offset{0.0, 0.0, 0.0};  ///< grey levels
};

/// For each channel and 8-bit value the grey level it would have had in the background's light.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& light);

/// The same for mean colours, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// Follows the light from frame to frame by a robust fit (own): block means outside the last contact that
/// agree with the last light (or with a shift by the median, where that explains clearly more blocks) are
/// fitted by least squares, three times over. Keeps the last light where fewer than a tenth of the blocks
/// agree.
class LightTracker {
 public:
  explicit LightTracker(const cv::Mat3f& background_blocks);

  /// `blocks`: block means of the frame; `excluded`: 255 where the object touches (may be empty).
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& excluded);

 private:
  int select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light, double gate);
  Light fit(const cv::Mat3f& blocks) const;
  Light shifted_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded) const;

  cv::Mat3f background_;
  cv::Mat1b inliers_;
  Light light_;
};

}  // namespace gelslam::surface::detail
