#include "self_similarity.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::loop_closure::detail {
namespace {

constexpr int kShrink =
    2;  // patterns that matter are many pixels wide, and a quarter of the pixels is enough
constexpr double kLeastShiftMm = 1.0;
constexpr double kLeastShared = 0.5;

cv::Mat spectrum(const cv::Mat1f& image, const cv::Size& size) {
  cv::Mat1f padded(size, 0.0F);
  image.copyTo(padded(cv::Rect({0, 0}, image.size())));
  cv::Mat result;
  cv::dft(padded, result, cv::DFT_COMPLEX_OUTPUT);
  return result;
}

// Sum over x of a(x) b(x + shift), for all shifts, as an image with shift 0 at its origin (shifts wrap
// around).
cv::Mat1f correlate(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat product;
  cv::mulSpectrums(b, a, product, 0, true);
  cv::Mat1f result;
  cv::idft(product, result, cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  return result;
}

}  // namespace

double self_similarity(const Surface& surface) {
  if (surface.contact_pixels == 0) return 0.0;
  cv::Mat1f mask, curvature;
  surface.contact.convertTo(mask, CV_32F, 1.0 / 255.0);
  cv::resize(mask, mask, {}, 1.0 / kShrink, 1.0 / kShrink, cv::INTER_NEAREST);
  cv::resize(surface.curvature, curvature, mask.size(), 0, 0, cv::INTER_AREA);
  const double pixels = cv::sum(mask)[0];
  if (pixels < 1) return 0.0;
  curvature -= static_cast<float>(curvature.dot(mask) / pixels);
  cv::multiply(curvature, mask, curvature);
  cv::Mat1f squared;
  cv::multiply(curvature, curvature, squared);

  const cv::Size size(cv::getOptimalDFTSize(2 * mask.cols), cv::getOptimalDFTSize(2 * mask.rows));
  const cv::Mat c = spectrum(curvature, size), c2 = spectrum(squared, size), m = spectrum(mask, size);
  const cv::Mat1f dot = correlate(c, c), energy = correlate(m, c2), other_energy = correlate(c2, m);
  const cv::Mat1f shared = correlate(m, m);

  const double least_shift_px = kLeastShiftMm / (surface.pixel_pitch_mm * kShrink);
  double largest = 0.0;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const double sx = std::min(x, size.width - x), sy = std::min(y, size.height - y);
      if (std::hypot(sx, sy) < least_shift_px || shared(y, x) < kLeastShared * pixels) continue;
      const double norm = std::sqrt(std::max(0.0F, energy(y, x)) * std::max(0.0F, other_energy(y, x)));
      if (norm > 1e-9) largest = std::max(largest, dot(y, x) / norm);
    }
  return largest;
}

}  // namespace gelslam::loop_closure::detail
