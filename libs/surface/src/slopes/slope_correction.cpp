#include "gelslam/surface/slope_correction.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/core/median.hpp"
#include "heights/contact_mask.hpp"
#include "heights/height_integrator.hpp"

namespace gelslam {

using namespace surface::detail;

namespace {

/// Median change in height on bare gel: the constant of integration.
float change_of_bare_gel(const cv::Mat1f& change, const Surface& read, const cv::Mat3f& rest_normals,
                         std::vector<float>& scratch) {
  constexpr float kFlatCosine = 0.9995F;  // tilted by less than 2 degrees
  scratch.clear();
  for (int v = 0; v < change.rows; ++v)
    for (int u = 0; u < change.cols; ++u)
      if (!read.contact(v, u) && read.normals(v, u).dot(rest_normals(v, u)) > kFlatCosine)
        scratch.push_back(change(v, u));
  if (scratch.empty()) scratch.assign(change.begin(), change.end());
  return quantile_in_place(scratch, 0.5);
}

/// `touched`: 1 in contact, 0 on bare gel, which is flat whatever the place.
float weighted(const SlopeCorrection::AxisTerms& terms, const double* factors, float touched) {
  constexpr std::size_t kOfSlope = SlopeCorrection::kTermsPerAxis - 2;  // the rest is of the place alone
  double by_slope = 0.0, by_place = 0.0;
  for (std::size_t k = 0; k < kOfSlope; ++k) by_slope += factors[k] * static_cast<double>(terms[k]);
  for (std::size_t k = kOfSlope; k < terms.size(); ++k)
    by_place += factors[k] * static_cast<double>(terms[k]);
  return static_cast<float>(by_slope + static_cast<double>(touched) * by_place);
}

}  // namespace

SlopeCorrection SlopeCorrection::from_linear(const Eigen::VectorXd& factors) {
  SlopeCorrection correction;
  for (Eigen::Index k = 0; k < factors.size(); ++k)
    correction.factors[kLinear[static_cast<std::size_t>(k)]] = factors[k];
  return correction;
}

Eigen::Vector4d SlopeCorrection::linear() const {
  return {factors[kLinear[0]], factors[kLinear[1]], factors[kLinear[2]], factors[kLinear[3]]};
}

GradientScale SlopeCorrection::scale() const {
  return {1.0 / (1.0 - factors[kScaleX]), 1.0 / (1.0 - factors[kScaleY])};
}

cv::Point2f SlopeCorrection::place(cv::Size size, cv::Point pixel) {
  const float half_width = 0.5F * static_cast<float>(size.width);
  const Eigen::Vector2f from_center_px = CameraModel{size, 1.0}.to_mm(pixel).cast<float>();
  return {from_center_px.x() / half_width, from_center_px.y() / half_width};
}

SlopeCorrection::Terms SlopeCorrection::terms(float x, float y, float gx, float gy) {
  constexpr float kSmallSlope = 0.07F;  // decay length, rad: below it a network may take colors for bare gel
  const float steepness2 = gx * gx + gy * gy, m = 1.0F / std::sqrt(1.0F + steepness2),
              small = std::exp(-std::sqrt(steepness2) / kSmallSlope);
  const auto of_axis = [&](float slope) {
    return AxisTerms{gx,          gy,          x * gx,      y * gx,        x * gy, y * gy,
                     m * gx * gx, m * gx * gy, m * gy * gy, small * slope, x,      y};
  };
  return {of_axis(gx), of_axis(gy)};
}

std::array<double, SlopeCorrection::kTerms> SlopeCorrection::prior_sigma(double gradient_scale_sigma,
                                                                         double model_sigma) {
  // Small slopes: root mean squares over sequences were 0.9 with one network, 0.3 and 0.2 with two others.
  constexpr double kPlace = 0.1, kSlope = 0.2, kSmall = 0.6, kBias = 0.02;
  const double cross = kCrossAxisShare * gradient_scale_sigma;
  const std::array<double, kTermsPerAxis> of_axis = {cross,  cross,  kPlace, kPlace, kPlace, kPlace,
                                                     kSlope, kSlope, kSlope, kSmall, kBias,  kBias};
  std::array<double, kTerms> sigma;
  std::copy(of_axis.begin(), of_axis.end(), sigma.begin());
  std::copy(of_axis.begin(), of_axis.end(), sigma.begin() + kTermsPerAxis);
  sigma[kScaleX] = sigma[kScaleY] = gradient_scale_sigma;
  for (double& of_factor : sigma) of_factor *= model_sigma;
  return sigma;
}

struct SlopeCorrector::Impl {
  explicit Impl(const CameraModel& model)
      : camera(model),
        integrator(camera),
        rest_normals(normals_from_gradient(integrator.rest_gx(), integrator.rest_gy())),
        gx(camera.size),
        gy(camera.size),
        dx(camera.size),
        dy(camera.size) {}

  CameraModel camera;
  HeightIntegrator integrator;
  cv::Mat3f rest_normals;
  cv::Mat1f gx, gy, dx, dy;  // read slopes, and what is added to them
  cv::Mat1f touched;         // 1 in contact, 0 on bare gel, and a membrane rim between
  std::vector<float> scratch;
};

SlopeCorrector::SlopeCorrector() = default;
SlopeCorrector::~SlopeCorrector() = default;

SurfacePtr SlopeCorrector::apply(const Surface& read, const SlopeCorrection& correction) {
  if (!impl_ || impl_->camera != read.camera()) impl_ = std::make_unique<Impl>(read.camera());
  Impl& self = *impl_;
  read.contact.convertTo(self.touched, CV_32F, 1.0 / 255.0);
  // From contact to bare gel there is a membrane rim.
  const int rim_px = 2 * cvRound(kRimLengthMm / (2 * read.pixel_pitch_mm)) + 1;
  cv::blur(self.touched, self.touched, cv::Size(rim_px, rim_px));
  for (int v = 0; v < read.normals.rows; ++v)
    for (int u = 0; u < read.normals.cols; ++u) {
      const cv::Vec3f& n = read.normals(v, u);
      const float gx = -n[0] / n[2], gy = -n[1] / n[2];
      const cv::Point2f place = SlopeCorrection::place(read.normals.size(), {u, v});
      const float touched = self.touched(v, u);
      // The gel at rest is known.
      const SlopeCorrection::Terms terms = SlopeCorrection::terms(
          place.x, place.y, gx - self.integrator.rest_gx()(v, u), gy - self.integrator.rest_gy()(v, u));
      const double* const factors = correction.factors.data();
      self.dx(v, u) = -weighted(terms[0], factors, touched);
      self.dy(v, u) = -weighted(terms[1], factors + SlopeCorrection::kTermsPerAxis, touched);
      self.gx(v, u) = gx;
      self.gy(v, u) = gy;
    }
  auto surface = std::make_shared<Surface>(read);
  const auto pitch_mm = static_cast<float>(read.pixel_pitch_mm);
  const cv::Mat1f change_px =
      self.integrator.relief_px(self.integrator.solve_change(self.gx, self.gy, self.dx, self.dy));
  const float level = change_of_bare_gel(change_px, read, self.rest_normals, self.scratch);
  surface->height_mm = read.height_mm.clone();
  self.integrator.to_relief(surface->height_mm);
  for (int v = 0; v < change_px.rows; ++v)
    for (int u = 0; u < change_px.cols; ++u) surface->height_mm(v, u) += pitch_mm * (change_px(v, u) - level);
  self.integrator.to_height(surface->height_mm);
  self.gx += self.dx;
  self.gy += self.dy;
  surface->normals = normals_from_gradient(self.gx, self.gy);
  return surface;
}

}  // namespace gelslam
