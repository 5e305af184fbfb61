// The standard deviation of the slopes that a gradient model reads, and the confidence of a pixel that
// follows from it. This is not in the papers.

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

// The standard deviation that is assumed at the distance s from the border of the picture is
// kBestSlopeSigmaRad + kBorderSigmaRad exp(-s / kBorderLengthMm). On rendered presses and scans, the error of
// a network that was trained on ball presses is 0.05 rad in the middle, 0.15 at 3 mm from the border, and 0.3
// at 1 mm.
constexpr double kBorderSigmaRad = 0.4, kBorderLengthMm = 1.6;

// The derivative of the read slope by the true slope, measured on presses of balls on two sensors: 1 up to 25
// degrees, then falling linearly to 0.15 at 31 degrees, the steepest slope that networks read
// (docs/benchmarks/slopes.png).
constexpr double kFollowedDeg = 25, kFallDeg = 7, kMinFollowed = 0.15;

constexpr int kFilledIn = 1;  // the value of Surface::confidence in pixels whose normals were interpolated

}  // namespace

SlopeUncertainty default_uncertainty(cv::Size picture, double pixel_pitch_mm) {
  SlopeUncertainty uncertainty{cv::Mat1f(GradientModel::kSigmaRows, GradientModel::kSigmaColumns)};
  cv::Mat1f& sigma = uncertainty.sigma_rad;
  const double cell_width = static_cast<double>(picture.width) / sigma.cols,
               cell_height = static_cast<double>(picture.height) / sigma.rows;
  for (int row = 0; row < sigma.rows; ++row)
    for (int column = 0; column < sigma.cols; ++column) {
      const double u = (column + 0.5) * cell_width, v = (row + 0.5) * cell_height;
      const double to_border_mm = pixel_pitch_mm * std::min({u, v, picture.width - u, picture.height - v});
      sigma(row, column) = static_cast<float>(kBestSlopeSigmaRad +
                                              kBorderSigmaRad * std::exp(-to_border_mm / kBorderLengthMm));
    }
  return uncertainty;
}

SlopeUncertainty uncertainty_of(const GradientModel& model, cv::Size picture, double pixel_pitch_mm) {
  if (model.sigma_rad.empty()) return default_uncertainty(picture, pixel_pitch_mm);
  return {cv::Mat1f(model.sigma_rad, true).reshape(1, GradientModel::kSigmaRows)};
}

double relative_sigma(const SlopeUncertainty& uncertainty) {
  double least = 0;
  cv::minMaxLoc(uncertainty.sigma_rad, &least);
  return least / kBestSlopeSigmaRad;
}

cv::Mat1b confidence_map(const SlopeUncertainty& uncertainty, cv::Size picture) {
  // A smaller standard deviation counts as kBestSlopeSigmaRad, because the smoothing by the gel is then the
  // larger error.
  const double least = std::max(1.0, relative_sigma(uncertainty)) * kBestSlopeSigmaRad;
  cv::Mat1f sigma;
  cv::resize(uncertainty.sigma_rad, sigma, picture, 0, 0, cv::INTER_LINEAR);
  cv::Mat1b map(picture);
  std::transform(sigma.begin(), sigma.end(), map.begin(), [least](float s) {
    const double share = std::min(1.0, least / static_cast<double>(s));
    return static_cast<unsigned char>(std::clamp(std::lround(255 * share * share), kFilledIn + 1L, 255L));
  });
  return map;
}

void lower_steep_confidence(const cv::Mat3f& normals, cv::Mat1b& confidence) {
  const double followed_nz = std::cos(kFollowedDeg * CV_PI / 180);
  std::transform(normals.begin(), normals.end(), confidence.begin(), confidence.begin(),
                 [=](const cv::Vec3f& normal, unsigned char known) -> unsigned char {
                   const double nz = normal[2];
                   if (known <= kFilledIn || nz >= followed_nz) return known;
                   const double slope_deg = std::acos(nz) * 180 / CV_PI;
                   const double followed =
                       std::max(kMinFollowed, (kFollowedDeg + kFallDeg - slope_deg) / kFallDeg);
                   return static_cast<unsigned char>(std::max(kFilledIn + 1.0, known * followed));
                 });
}

bool is_read(const Surface& surface, cv::Point pixel) {
  return surface.confidence.empty() ? surface.contact(pixel) != 0 : surface.confidence(pixel) > kFilledIn;
}

cv::Mat1b read_contact(const Surface& surface) {
  if (surface.confidence.empty()) return surface.contact;
  cv::Mat1b read;
  cv::compare(surface.confidence, kFilledIn, read, cv::CMP_GT);
  return read;
}

}  // namespace gelslam
