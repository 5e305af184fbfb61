#include "glare.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

constexpr int full_value = 250;  // JPEG takes a little off
constexpr int spread_px = 4;     // of a highlight by lens and JPEG
constexpr int reach_px = 12;     // filled from as far; the middle of a larger one is taken for bare gel

// Two of the three are full.
bool is_full(const cv::Vec3b& colour) {
  return (colour[0] >= full_value) + (colour[1] >= full_value) + (colour[2] >= full_value) >= 2;
}

}  // namespace

GlareRemover::GlareRemover(const cv::Mat3b& background) : bright_(background.size()) {
  std::transform(background.begin(), background.end(), bright_.begin(),
                 [](const cv::Vec3b& colour) { return is_full(colour) ? 255 : 0; });
  background.convertTo(background_, CV_32F);
}

bool GlareRemover::find(const cv::Mat3b& bgr) {
  // Nearly every picture ends here.
  cv::compare(bgr.reshape(1), full_value, full_, cv::CMP_GE);
  if (cv::countNonZero(full_) < 2) return false;
  cv::Mat1b glare(bgr.size());
  std::transform(bgr.begin(), bgr.end(), glare.begin(),
                 [](const cv::Vec3b& colour) { return is_full(colour) ? 255 : 0; });
  glare.setTo(0, bright_);
  if (cv::countNonZero(glare) == 0) return false;
  const int side = 2 * spread_px + 1;
  cv::dilate(glare, glare, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  read_ = (glare == 0) & 1;
  return true;
}

const cv::Mat3b& GlareRemover::clean(const cv::Mat3b& bgr) {
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

}  // namespace gelslam::surface::detail
