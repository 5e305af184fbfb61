#include "texture_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/se3.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam::registration::detail {
namespace {

cv::Mat spectrum(const cv::Mat1f& image) {
  const cv::Size size(cv::getOptimalDFTSize(2 * image.cols), cv::getOptimalDFTSize(2 * image.rows));
  cv::Mat1f padded(size, 0.0F);
  image.copyTo(padded(cv::Rect({0, 0}, image.size())));
  cv::Mat result;
  cv::dft(padded, result);
  return result;
}

cv::Mat1f squared(const cv::Mat1f& image) {
  cv::Mat1f result;
  cv::multiply(image, image, result);
  return result;
}

/// Sum over x of a(x) b(x + shift), for all shifts.
cv::Mat1f correlate(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat product;
  cv::mulSpectrums(b, a, product, 0, true);
  cv::Mat1f result;
  cv::idft(product, result, cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  return result;
}

}  // namespace

CoarseTexture::CoarseTexture(const Surface& surface, int shrink)
    : pixel_pitch_mm(surface.pixel_pitch_mm * shrink) {
  read_contact(surface).convertTo(mask, CV_32F, 1.0 / 255.0);
  cv::resize(mask, mask, {}, 1.0 / shrink, 1.0 / shrink, cv::INTER_NEAREST);
  cv::resize(surface.curvature, curvature, mask.size(), 0, 0, cv::INTER_AREA);
  remove_mean();
}

CoarseTexture CoarseTexture::turned(double angle_rad) const {
  // OpenCV counts angles the other way round, as its y points down and its angles do not.
  const cv::Point2f center(static_cast<float>(mask.cols - 1) / 2, static_cast<float>(mask.rows - 1) / 2);
  const cv::Mat turn = cv::getRotationMatrix2D(center, -angle_rad * kDegreesPerRadian, 1.0);
  CoarseTexture result;
  result.pixel_pitch_mm = pixel_pitch_mm;
  cv::warpAffine(mask, result.mask, turn, mask.size(), cv::INTER_NEAREST);
  cv::warpAffine(curvature, result.curvature, turn, mask.size(), cv::INTER_LINEAR);
  result.remove_mean();
  return result;
}

void CoarseTexture::crop() {
  const cv::Rect box = cv::boundingRect(cv::Mat1b(mask > 0));
  mask = mask(box);
  curvature = curvature(box);
}

void CoarseTexture::remove_mean() {
  pixels = cv::sum(mask)[0];
  if (pixels > 0) curvature -= static_cast<float>(curvature.dot(mask) / pixels);
  cv::multiply(curvature, mask, curvature);
}

TextureSpectrum::TextureSpectrum(const CoarseTexture& texture)
    : curvature_(spectrum(texture.curvature)),
      squared_(spectrum(squared(texture.curvature))),
      mask_(spectrum(texture.mask)) {}

TextureSpectrum::Agreement TextureSpectrum::laid_on(const TextureSpectrum& other) const {
  const cv::Mat1f dot = correlate(curvature_, other.curvature_), energy = correlate(squared_, other.mask_),
                  other_energy = correlate(mask_, other.squared_);
  Agreement agreement{cv::Mat1f(dot.size(), 0.0F), correlate(mask_, other.mask_)};
  for (int y = 0; y < dot.rows; ++y)
    for (int x = 0; x < dot.cols; ++x) {
      const float norm = std::sqrt(std::max(0.0F, energy(y, x)) * std::max(0.0F, other_energy(y, x)));
      if (norm > 1e-9F) agreement.similarity(y, x) = dot(y, x) / norm;
    }
  return agreement;
}

}  // namespace gelslam::registration::detail

namespace gelslam {

using namespace registration::detail;

double self_similarity(const Surface& surface) {
  constexpr double kMinShared = 0.5;  // numerics: fewer pixels correlate by chance
  if (surface.contact_pixels == 0) return 0.0;
  CoarseTexture texture(surface);
  if (texture.pixels < 1) return 0.0;
  texture.crop();
  const TextureSpectrum spectrum(texture);
  const auto [similarity, shared] = spectrum.laid_on(spectrum);
  const double min_shift_px = kMinPeriodMm / texture.pixel_pitch_mm;
  double largest = 0.0;
  for (int y = 0; y < similarity.rows; ++y)
    for (int x = 0; x < similarity.cols; ++x) {
      const double sx = std::min(x, similarity.cols - x), sy = std::min(y, similarity.rows - y);
      if (std::hypot(sx, sy) >= min_shift_px && shared(y, x) >= kMinShared * texture.pixels)
        largest = std::max(largest, static_cast<double>(similarity(y, x)));
    }
  return largest;
}

}  // namespace gelslam
