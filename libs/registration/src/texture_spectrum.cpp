// Correlates the curvature maps of two contacts at all shifts at once, by fast Fourier transforms. The
// normalized cross-correlation over the pixels that both contacts cover follows Padfield, "Masked object
// registration in the Fourier domain" (IEEE TIP 2012); as the mean of each map over its own contact is
// removed in advance, it is not recomputed for each overlap.

#include "texture_spectrum.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/se3.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam::registration::detail {
namespace {

cv::Mat spectrum(const cv::Mat1f& image, cv::Size size) {
  cv::Mat1f padded(cv::getOptimalDFTSize(size.height), cv::getOptimalDFTSize(size.width), 0.0F);
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

/// Returns the sum over x of a(x) b(x + shift), for all shifts.
cv::Mat1f correlate(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat product;
  cv::mulSpectrums(b, a, product, 0, true);
  cv::Mat1f result;
  cv::idft(product, result, cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  return result;
}

/// Returns the vector from the center of a picture to that of its first pixel.
Eigen::Vector2d corner_px(const cv::Mat& image) {
  return -0.5 * Eigen::Vector2d(image.cols - 1, image.rows - 1);
}

}  // namespace

CoarseTexture::CoarseTexture(const Surface& surface, int shrink)
    : pixel_pitch_mm(surface.pixel_pitch_mm * shrink) {
  read_contact(surface).convertTo(mask, CV_32F, 1.0 / 255.0);
  cv::resize(mask, mask, {}, 1.0 / shrink, 1.0 / shrink, cv::INTER_NEAREST);
  cv::resize(surface.curvature, curvature, mask.size(), 0, 0, cv::INTER_AREA);
  origin_px = corner_px(mask);
  crop_to_contact();
}

CoarseTexture CoarseTexture::turned(double angle_rad) const {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
  const Eigen::Vector2d size = turn.cwiseAbs() * Eigen::Vector2d(mask.cols, mask.rows);
  CoarseTexture result;
  result.pixel_pitch_mm = pixel_pitch_mm;
  result.mask.create(static_cast<int>(size.y()) + 2, static_cast<int>(size.x()) + 2);
  // The texture is shifted by whole pixels, so that a texture with the angle 0 is not blurred.
  const Eigen::Vector2d room((result.mask.cols - mask.cols) / 2, (result.mask.rows - mask.rows) / 2);
  const Eigen::Vector2d moved = turn * corner_px(mask) - corner_px(mask) + room;
  const cv::Matx23d turn_px(turn(0, 0), turn(0, 1), moved.x(), turn(1, 0), turn(1, 1), moved.y());
  cv::warpAffine(curvature, result.curvature, turn_px, result.mask.size(), cv::INTER_LINEAR);
  cv::warpAffine(mask, result.mask, turn_px, result.mask.size(), cv::INTER_NEAREST);
  result.origin_px = turn * origin_px - moved;
  result.crop_to_contact();
  return result;
}

void CoarseTexture::crop_to_contact() {
  const cv::Rect box = cv::boundingRect(cv::Mat1b(mask > 0));
  mask = mask(box);
  curvature = curvature(box);
  origin_px += Eigen::Vector2d(box.x, box.y);
  pixels = cv::sum(mask)[0];
  if (pixels > 0) curvature -= static_cast<float>(curvature.dot(mask) / pixels);
  cv::multiply(curvature, mask, curvature);
}

TextureSpectrum::TextureSpectrum(const CoarseTexture& texture, cv::Size size)
    : curvature_(spectrum(texture.curvature, size)),
      squared_(spectrum(squared(texture.curvature), size)),
      mask_(spectrum(texture.mask, size)) {}

TextureSpectrum::Agreement TextureSpectrum::correlated_with(const TextureSpectrum& other) const {
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
  constexpr double kMinShared = 0.5;  // fewer pixels could correlate by chance
  if (surface.contact_pixels == 0) return 0.0;
  const CoarseTexture texture(surface);
  if (texture.pixels < 1) return 0.0;
  const TextureSpectrum spectrum(texture, texture.mask.size() * 2);
  const auto [similarity, shared] = spectrum.correlated_with(spectrum);
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
