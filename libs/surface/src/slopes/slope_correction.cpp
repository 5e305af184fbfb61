#include "gelslam/surface/slope_correction.hpp"

#include <opencv2/core.hpp>
#include <vector>

#include "gelslam/core/median.hpp"
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

}  // namespace

SlopeCorrection SlopeCorrection::from_unknowns(const Eigen::VectorXd& unknowns) {
  SlopeCorrection correction;
  if (unknowns.size() > 0) correction.factors = unknowns;
  return correction;
}

GradientScale SlopeCorrection::scale() const { return {1.0 / (1.0 - factors[0]), 1.0 / (1.0 - factors[3])}; }

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
  std::vector<float> scratch;
};

SlopeCorrector::SlopeCorrector() = default;
SlopeCorrector::~SlopeCorrector() = default;

SurfacePtr SlopeCorrector::apply(const Surface& read, const SlopeCorrection& correction) {
  if (!impl_ || impl_->camera != read.camera()) impl_ = std::make_unique<Impl>(read.camera());
  Impl& self = *impl_;
  const Eigen::Vector4f factors = correction.factors.cast<float>();
  for (int v = 0; v < read.normals.rows; ++v)
    for (int u = 0; u < read.normals.cols; ++u) {
      const cv::Vec3f& n = read.normals(v, u);
      self.gx(v, u) = -n[0] / n[2];
      self.gy(v, u) = -n[1] / n[2];
      // The gel at rest is known.
      const float gx = self.gx(v, u) - self.integrator.rest_gx()(v, u),
                  gy = self.gy(v, u) - self.integrator.rest_gy()(v, u);
      self.dx(v, u) = -factors[0] * gx - factors[1] * gy;
      self.dy(v, u) = -factors[2] * gx - factors[3] * gy;
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
