// SIFT features (Lowe 2004) of a curvature map (Huang et al., GelSLAM, T-RO 2026, section V). Unlike heights,
// curvature hardly depends on how the sensor is tilted and how deep it is pressed. Features near the
// contact's border are left out, because the gel there follows its own rim and not the object.

#include "place_features.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace gelslam::loop_closure::detail {
namespace {

constexpr double kMinFullScalePerMm = 0.789;  // The noise of a sensor amounts to a fifth of this.
constexpr double kSiftContrast = 0.02;

cv::Mat1b inner_contact(const Surface& surface) {
  const auto margin = static_cast<int>(std::lround(kRimMm / surface.pixel_pitch_mm));
  cv::Mat1b padded, eroded;
  // The contact is cut off at the image border, so the border is eroded like the rim of the contact.
  cv::copyMakeBorder(surface.contact, padded, margin, margin, margin, margin, cv::BORDER_CONSTANT, 0);
  cv::erode(padded, eroded, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * margin + 1, 2 * margin + 1}));
  return eroded(cv::Rect(margin, margin, surface.contact.cols, surface.contact.rows)).clone();
}

// Converts curvature to gray levels. SIFT's contrast threshold is absolute, so with a fixed scale no features
// would be found on shallow texture (a worn coin bends the gel twenty times less than a knurl). Four times
// the root mean square curvature is therefore mapped to the full range. Descriptors do not depend on
// contrast, so frames with different scales can still be matched. The lower limit of the scale keeps the
// noise on a smooth surface from becoming features.
cv::Mat1b gray_curvature(const Surface& surface, const cv::Mat1b& mask) {
  const double rms = std::sqrt(cv::mean(surface.curvature.mul(surface.curvature), mask)[0]);
  const double full_scale = std::clamp(4.0 * rms, kMinFullScalePerMm * surface.pixel_pitch_mm,
                                       kMaxCurvaturePerMm * surface.pixel_pitch_mm);
  cv::Mat1b gray;
  surface.curvature.convertTo(gray, CV_8U, 127.5 / full_scale, 127.5);
  return gray;
}

}  // namespace

/// Returns a box around the contact, with a margin for the largest blobs. Its corner lies on the grid of
/// SIFT's coarsest octave, so that the box does not change the features found.
cv::Rect around(const cv::Mat1b& mask) {
  constexpr int kGridPx = 32;
  const cv::Rect box = cv::boundingRect(mask);
  const cv::Point first = (box.tl() - cv::Point(kGridPx, kGridPx)) / kGridPx * kGridPx;
  return cv::Rect(first, box.br() + cv::Point(kGridPx, kGridPx)) & cv::Rect(cv::Point(), mask.size());
}

PlaceFeatures extract_features(const Surface& surface, const LoopClosureOptions& options) {
  PlaceFeatures features;
  const cv::Mat1b mask = inner_contact(surface);
  if (cv::countNonZero(mask) == 0) return features;

  constexpr int kOctaveLayers = 3;  // As published (Lowe 2004).
  const cv::Ptr<cv::SIFT> sift = cv::SIFT::create(options.max_features, kOctaveLayers, kSiftContrast);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat1f descriptors;
  const cv::Rect box = around(mask);
  sift->detectAndCompute(gray_curvature(surface, mask)(box), mask(box), keypoints, descriptors);
  features.descriptors.reserve(descriptors.total());
  for (int i = 0; i < descriptors.rows; ++i) {
    const cv::Point2f& p = keypoints[static_cast<std::size_t>(i)].pt;
    features.pixels.emplace_back(p.x + static_cast<float>(box.x), p.y + static_cast<float>(box.y));
    for (int k = 0; k < kDescriptorSize; ++k)
      features.descriptors.push_back(static_cast<std::uint8_t>(std::lround(descriptors(i, k))));
  }
  return features;
}

}  // namespace gelslam::loop_closure::detail
