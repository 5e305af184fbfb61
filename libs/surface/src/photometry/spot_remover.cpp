#include "photometry/spot_remover.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

constexpr int full_value = 250;     // JPEG takes a little off
constexpr float dark_share = 0.5F;  // of the background's brightness
constexpr int spread_px = 4;        // of a spot by lens and JPEG
constexpr int reach_px = 12;        // filled from as far; the middle of a larger spot is taken for bare gel
constexpr int most_dark_share =
    8;  // one in so many: when more of the picture is dark, it is the light that fails

/// 255 where two of the three channels are full, else 0.
void mark_full(const cv::Mat3b& bgr, cv::Mat1b& full) {
  std::transform(bgr.begin(), bgr.end(), full.begin(), [](const cv::Vec3b& color) {
    return (color[0] >= full_value) + (color[1] >= full_value) + (color[2] >= full_value) >= 2 ? 255 : 0;
  });
}

}  // namespace

SpotRemover::SpotRemover(const cv::Mat3b& background)
    : dark_limit_(background.size()), bright_background_(background.size()), spots_(background.size()) {
  mark_full(background, bright_background_);
  background.convertTo(background_, CV_32F);
  background.convertTo(dark_limit_, CV_8U, dark_share);
  // Where no lamp shines, dark is no news: a range that holds nothing.
  constexpr unsigned char least_limit = 10;
  dark_from_ = cv::Mat3b(background.size(), cv::Vec3b(0, 0, 0));
  std::transform(dark_limit_.begin(), dark_limit_.end(), dark_from_.begin(), [](const cv::Vec3b& limit) {
    return std::min({limit[0], limit[1], limit[2]}) < least_limit ? cv::Vec3b(255, 255, 255)
                                                                  : cv::Vec3b(0, 0, 0);
  });
}

const cv::Mat3b& SpotRemover::clean(const cv::Mat3b& bgr) {
  if (!find(bgr)) return bgr;
  bgr.convertTo(difference_, CV_32F);
  difference_ -= background_;
  difference_.setTo(cv::Scalar::all(0), read_ == 0);
  read_.convertTo(weight_, CV_32F);
  // Twice a box is nearly a cone: what is near counts most.
  cv::Mat3f around = difference_;
  for (int pass = 0; pass < 2; ++pass) {
    const cv::Size box(reach_px + 1, reach_px + 1);
    cv::boxFilter(around, around, CV_32F, box);
    cv::boxFilter(weight_, weight_, CV_32F, box);
  }
  constexpr float least_weight = 1e-3F;
  bgr.copyTo(cleaned_);
  for (int v = 0; v < bgr.rows; ++v) {
    for (int u = 0; u < bgr.cols; ++u) {
      if (read_(v, u) != 0) continue;
      const float weight = weight_(v, u);
      const cv::Vec3f filled =
          weight > least_weight ? background_(v, u) + around(v, u) / weight : background_(v, u);
      for (int c = 0; c < 3; ++c) cleaned_(v, u)[c] = cv::saturate_cast<unsigned char>(filled[c]);
    }
  }
  return cleaned_;
}

// Nearly every picture has none, and two quick looks tell.
bool SpotRemover::find(const cv::Mat3b& bgr) {
  cv::compare(bgr.reshape(1), full_value, full_, cv::CMP_GE);
  cv::inRange(bgr, dark_from_, dark_limit_, dark_);
  const int full = cv::countNonZero(full_), dark = cv::countNonZero(dark_);
  if (full < 2 && dark == 0) return false;
  mark_full(bgr, spots_);
  spots_.setTo(0, bright_background_);
  if (dark * most_dark_share < static_cast<int>(bgr.total())) spots_ |= dark_;
  if (cv::countNonZero(spots_) == 0) return false;
  const int side = 2 * spread_px + 1;
  cv::dilate(spots_, spots_, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  read_ = (spots_ == 0) & 1;
  return true;
}

}  // namespace gelslam::surface::detail
