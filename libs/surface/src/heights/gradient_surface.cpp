#include "gelslam/surface/gradient_surface.hpp"

#include <opencv2/imgproc.hpp>
#include <vector>

#include "heights/contact_mask.hpp"
#include "heights/poisson.hpp"

namespace gelslam {

using namespace surface::detail;

struct GradientSurfaces::Impl {
  Impl(cv::Size size, double pitch_mm)
      : poisson(size),
        pixel_pitch_mm(pitch_mm),
        border(cv::getStructuringElement(cv::MORPH_RECT,
                                         cv::Size(2 * (size.height / 48) + 1, 2 * (size.height / 48) + 1))) {}

  PoissonSolver poisson;
  double pixel_pitch_mm;
  cv::Mat border;
  std::vector<float> scratch;
};

GradientSurfaces::GradientSurfaces(cv::Size size, double pixel_pitch_mm)
    : impl_(std::make_unique<Impl>(size, pixel_pitch_mm)) {}
GradientSurfaces::~GradientSurfaces() = default;

SurfacePtr GradientSurfaces::make(const cv::Mat1f& gx, const cv::Mat1f& gy, const cv::Mat1b& touched) {
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = impl_->pixel_pitch_mm;
  const cv::Mat1f height_px = impl_->poisson.solve(gx, gy);
  cv::Mat1b disturbed;  // the gel moves beyond the contact, too
  cv::dilate(touched, disturbed, impl_->border);
  const UntouchedGel gel = find_untouched_gel(height_px, disturbed, impl_->scratch);
  surface->zero_is_bare_gel = gel.seen;
  height_px.convertTo(surface->height_mm, CV_32F, impl_->pixel_pitch_mm, -impl_->pixel_pitch_mm * gel.level);
  cv::erode(touched != 0, surface->contact, impl_->border);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  surface->normals = normals_from_gradient(gx, gy);
  surface->curvature = curvature_in_contact(impl_->poisson, surface->contact);
  return surface;
}

}  // namespace gelslam
