#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "photometry/light.hpp"

namespace gelslam::surface::detail {

/// Follows the light from frame to frame by a robust fit (own): block means outside the last contact that
/// agree with the last light (or with a shift or a gain by the median, where that explains clearly more
/// blocks) are fitted by least squares, three times over. Keeps the last light where fewer than a tenth of
/// the blocks agree.
class LightTracker {
 public:
  /// `uneven`: also look for light from one side or in bands, where light that is the same everywhere
  /// explains little. (A contact may look like that, too, as long as it is not known where it is.)
  explicit LightTracker(const cv::Mat3f& background_blocks, bool uneven = false);

  /// `blocks`: block means of the frame; `excluded`: 255 where the object touches (may be empty).
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& excluded);

 private:
  struct Fit {
    Light light;
    int agree = 0;  // blocks
  };

  int select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light, double gate);
  template <int terms>
  bool fit(const cv::Mat3f& blocks, Unevenness unevenness, const Gains& expected, Light& light) const;
  Light fit_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded, bool as_gain) const;
  Fit refine_even(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light);
  Fit refine_uneven(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light, Unevenness unevenness,
                    double gate);
  std::vector<double> fit_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light) const;
  Fit refine_banded(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light);
  Fit search(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Fit& followed);

  cv::Mat3f background_;
  bool may_be_uneven_;
  cv::Mat1b inliers_;
  Light light_;
  /// Noise, too, makes few blocks agree: where a search found nothing better, this share did, and none is
  /// made again until clearly fewer do.
  double vain_share_ = 1.0;
};

}  // namespace gelslam::surface::detail
