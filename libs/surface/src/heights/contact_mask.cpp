#include "heights/contact_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

// The length L of ContactDetector. Beside 76 presses of balls on two sensors, the depth of the gel falls by a
// factor e over 0.6 to 0.75 mm.
constexpr double kRimLengthMm = 0.7;
// The smallest pressure in a contact divided by the depth: half way between gel that is draped beside an
// object (0) and gel under a flat face (1).
constexpr double kPressedShare = 0.5;
// The standard deviation of the Gaussian that averages the noise of the curvature. A wider one would take
// draped gel at the rim for contact.
constexpr double kSmoothedMm = 0.15;
// Specks of contact that are narrower than twice this length are noise, and are removed.
constexpr double kSpeckMm = 0.13;
// The largest hole that is filled. Between two faces at a distance of 2.6 L, the gel returns half way to its
// level at rest.
constexpr double kMaxHoleMm2 = 2.6 * kRimLengthMm * 2.6 * kRimLengthMm;
// The error of the depth is the largest of three terms: the integrated noise of the gradient model, in mm
// (for slope_noise_ratio 1); this many standard deviations of the heights of bare gel; and this fraction of
// the largest depth (for slope_sigma_ratio 1).
constexpr double kMinDepthMm = 0.015;
constexpr double kScattersAboveGel = 4;
constexpr double kErrorOfDepth = 0.05;
// The error of the pressure is this fraction of the largest depth. It does not depend on the model, because
// it is caused by the curvature, on which a wrong scale or tilt has no influence. With 0.02 to 0.05, specks
// of bare gel are kept out of the contact.
constexpr double kErrorOfPressure = 0.03;

}  // namespace

cv::Rect grown(const cv::Rect& box, int margin, cv::Size image) {
  if (box.empty()) return box;
  return (box + cv::Size(2 * margin, 2 * margin) - cv::Point(margin, margin)) & cv::Rect({}, image);
}

ContactDetector::ContactDetector(double pixel_pitch_mm) : pitch_mm_(pixel_pitch_mm) {
  const int side_px = 2 * static_cast<int>(std::lround(kSpeckMm / pitch_mm_)) + 1;
  speck_ = cv::getStructuringElement(cv::MORPH_RECT, {side_px, side_px});
}

void ContactDetector::detect(const cv::Mat1f& height_mm, const cv::Mat1f& curvature_per_px,
                             const cv::Mat1b& changed, const HeightQuality& quality, cv::Mat1b& contact) {
  if (!quality.bare_gel_is_seen) {
    changed.copyTo(contact);
    close(cv::Mat1b(contact.size(), static_cast<unsigned char>(255)), contact);
    return;
  }
  cv::resize(height_mm, blocks_, block_grid(height_mm.size()), 0, 0, cv::INTER_AREA);
  const double deepest_mm = -static_cast<double>(*std::min_element(blocks_.begin(), blocks_.end()));
  const double error_mm = std::max({quality.slope_noise_ratio * kMinDepthMm,
                                    kScattersAboveGel * static_cast<double>(quality.bare_scatter_mm),
                                    kErrorOfDepth * quality.slope_sigma_ratio * deepest_mm});
  cv::compare(height_mm, -error_mm, below_, cv::CMP_LT);
  contact = cv::Mat1b::zeros(height_mm.size());
  // The box that can contain contact, with a margin for the kernel that smooths the pressure.
  const double smoothed_px = kSmoothedMm / pitch_mm_;
  const cv::Rect box =
      grown(cv::boundingRect(below_), static_cast<int>(std::ceil(4 * smoothed_px)), contact.size());
  if (box.empty()) return;
  cv::Mat1b pressed = contact(box);
  cv::addWeighted(height_mm(box), kPressedShare - 1, curvature_per_px(box),
                  kRimLengthMm * kRimLengthMm / pitch_mm_, 0, pressure_);
  cv::GaussianBlur(pressure_, pressure_, {}, smoothed_px);
  cv::compare(pressure_, kErrorOfPressure * deepest_mm, pressed, cv::CMP_GT);
  cv::bitwise_and(pressed, below_(box), pressed);
  close(below_(box), pressed);
}

/// Fills small holes of the contact where the gel is `below` its level at rest, and then removes specks. A
/// gap that reaches the border of the picture is no hole.
void ContactDetector::close(const cv::Mat1b& below, cv::Mat1b& contact) {
  cv::findContours(contact, contours_, hierarchy_, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
  holes_ = cv::Mat1b::zeros(contact.size());
  for (std::size_t i = 0; i < contours_.size(); ++i) {
    const bool is_hole = hierarchy_[i][3] >= 0;
    if (is_hole && cv::contourArea(contours_[i]) < kMaxHoleMm2 / (pitch_mm_ * pitch_mm_))
      cv::drawContours(holes_, contours_, static_cast<int>(i), 255, cv::FILLED);
  }
  contact.setTo(255, holes_ & below);
  cv::morphologyEx(contact, contact, cv::MORPH_OPEN, speck_);
}

}  // namespace gelslam::surface::detail
