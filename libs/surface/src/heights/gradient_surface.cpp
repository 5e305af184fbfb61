// Makes surfaces from gradients that another program has read, with the same integration, leveling, normals
// and curvature as SurfaceEstimator. The contact is not found by ContactDetector: it is the given mask,
// eroded as in the public systems.

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/surface/slopes.hpp"
#include "heights/bare_gel.hpp"
#include "heights/height_integrator.hpp"
#include "heights/normals.hpp"
#include "photometry/blocks.hpp"

namespace gelslam {

using namespace surface::detail;

struct GradientSurfaces::Impl {
  explicit Impl(const CameraModel& model) : camera(model), integrator(camera), leveler(camera) {}

  CameraModel camera;
  HeightIntegrator integrator;
  BareGelLeveler leveler;
};

cv::Mat GradientSurfaces::border(double pixel_pitch_mm) {
  const int side_px = 2 * static_cast<int>(std::lround(kRimMm / pixel_pitch_mm)) + 1;
  return cv::getStructuringElement(cv::MORPH_RECT, {side_px, side_px});
}

GradientSurfaces::GradientSurfaces(const CameraModel& camera) : impl_(std::make_unique<Impl>(camera)) {}
GradientSurfaces::~GradientSurfaces() = default;

SurfacePtr GradientSurfaces::make(const cv::Mat1f& relative_gx, const cv::Mat1f& relative_gy,
                                  const cv::Mat1b& touched) {
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = impl_->camera.pitch_mm;
  surface->optics = impl_->camera.optics;
  // The gel around a contact is deformed, too. It is taken for bare only where its slope is below this limit.
  constexpr double kStillSlope = 0.02;
  cv::Mat1f slope;
  cv::magnitude(relative_gx, relative_gy, slope);
  cv::Mat1b disturbed;
  cv::compare(slope, kStillSlope, disturbed, cv::CMP_GT);
  cv::bitwise_or(disturbed, touched, disturbed);
  cv::Mat1b blocks;
  gather_blocks(disturbed, blocks);
  cv::Mat1f gx = relative_gx.clone(), gy = relative_gy.clone();
  cv::Mat1f relief_px = impl_->integrator.solve(gx, gy);
  surface->zero_is_bare_gel = impl_->leveler.level(relief_px, blocks, impl_->integrator.solver()).seen;
  surface->height_mm = impl_->integrator.relief_mm(relief_px);
  impl_->integrator.to_height(surface->height_mm);
  cv::erode(touched != 0, surface->contact, border(impl_->camera.pitch_mm));
  surface->contact_pixels = cv::countNonZero(surface->contact);
  surface->normals = normals_from_gradient(gx, gy);
  surface->curvature = curvature_in_contact(divergence(gx, gy), surface->contact, surface->pixel_pitch_mm);
  return surface;
}

}  // namespace gelslam
