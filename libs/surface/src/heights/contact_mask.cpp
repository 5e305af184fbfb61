#include "heights/contact_mask.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

// L: gel beside 76 presses of balls on two sensors falls off by 1/e over 0.6 to 0.75 mm.
constexpr double kRimLengthMm = 0.7;
// Half way between the gel beside an object (0) and gel under a flat face (1).
constexpr double kPressedShare = 0.5;
// Noise of the curvature is averaged over this, and no more: wider averages take the rim for contact.
constexpr double kSmoothedMm = 0.15;
// Specks that are thinner than twice this are noise.
constexpr double kSpeckMm = 0.13;
// Between two faces at a distance of 2.6 L the gel returns half way to rest.
constexpr double kMaxHoleMm2 = 2.6 * kRimLengthMm * 2.6 * kRimLengthMm;
constexpr double kMinDepthMm = 0.015;  // what the network's own noise integrates to
constexpr double kScattersAboveGel = 4;
// Heights err by this share of the deepest place, if slopes err as those of a sensor's own model do.
constexpr double kErrorOfDepth = 0.05;
// The pressure errs by this share of the deepest place with any model: its error is that of the curvature,
// which no wrong scale or tilt enlarges. 0.02 to 0.05 keep islands out.
constexpr double kErrorOfPressure = 0.03;

}  // namespace

cv::Rect grown(const cv::Rect& box, int margin, cv::Size image) {
  if (box.empty()) return box;
  return (box + cv::Size(2 * margin, 2 * margin) - cv::Point(margin, margin)) & cv::Rect({}, image);
}

ContactDetector::ContactDetector(cv::Size size, double pixel_pitch_mm)
    : pitch_mm_(pixel_pitch_mm), pressure_(size) {
  const int side_px = 2 * static_cast<int>(std::lround(kSpeckMm / pitch_mm_)) + 1;
  speck_ = cv::getStructuringElement(cv::MORPH_RECT, {side_px, side_px});
}

void ContactDetector::detect(const cv::Mat1f& height_mm, const cv::Mat1f& curvature_per_px,
                             const cv::Mat1b& changed, const HeightQuality& quality, cv::Mat1b& contact) {
  if (quality.bare_gel_is_seen) {
    find_pressed(height_mm, curvature_per_px, quality, contact);
  } else {
    below_ = cv::Mat1b(changed.size(), static_cast<unsigned char>(255));
    changed.copyTo(contact);
  }
  fill_small_holes(below_, contact);
  cv::morphologyEx(contact, contact, cv::MORPH_OPEN, speck_);
}

void ContactDetector::find_pressed(const cv::Mat1f& height_mm, const cv::Mat1f& curvature_per_px,
                                   const HeightQuality& quality, cv::Mat1b& contact) {
  cv::resize(height_mm, blocks_, block_grid(height_mm.size()), 0, 0, cv::INTER_AREA);
  const double deepest_mm = -static_cast<double>(*std::min_element(blocks_.begin(), blocks_.end()));
  const double error_mm = std::max({quality.slope_noise * kMinDepthMm,
                                    kScattersAboveGel * static_cast<double>(quality.bare_scatter_mm),
                                    kErrorOfDepth * quality.model_sigma * deepest_mm});
  cv::compare(height_mm, -error_mm, below_, cv::CMP_LT);
  cv::addWeighted(height_mm, kPressedShare - 1, curvature_per_px, kRimLengthMm * kRimLengthMm / pitch_mm_, 0,
                  pressure_);
  cv::GaussianBlur(pressure_, pressure_, {}, kSmoothedMm / pitch_mm_);
  cv::compare(pressure_, kErrorOfPressure * deepest_mm, contact, cv::CMP_GT);
  cv::bitwise_and(contact, below_, contact);
}

/// `below`: where the gel is not at rest. A hole that reaches the picture's border is open.
void ContactDetector::fill_small_holes(const cv::Mat1b& below, cv::Mat1b& contact) {
  cv::bitwise_not(contact, holes_);
  const int count = cv::connectedComponents(holes_, labels_, 4, CV_32S);
  constexpr int kOpen = std::numeric_limits<int>::max();
  area_px_.assign(static_cast<std::size_t>(count), 0);
  const auto area_px = [&](int v, int u) -> int& {
    return area_px_[static_cast<std::size_t>(labels_(v, u))];
  };
  area_px_[0] = kOpen;  // the contact
  for (int v = 0; v < contact.rows; ++v) area_px(v, 0) = area_px(v, contact.cols - 1) = kOpen;
  for (int u = 0; u < contact.cols; ++u) area_px(0, u) = area_px(contact.rows - 1, u) = kOpen;
  if (std::all_of(area_px_.begin(), area_px_.end(), [](int area) { return area == kOpen; })) return;
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u)
      if (int& area = area_px(v, u); area != kOpen) ++area;
  const double largest_px = kMaxHoleMm2 / (pitch_mm_ * pitch_mm_);
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u)
      if (area_px(v, u) < largest_px && below(v, u)) contact(v, u) = 255;
}

}  // namespace gelslam::surface::detail
