#include <opencv2/imgproc.hpp>

#include "gelslam/surface/slopes.hpp"
#include "heights/bare_gel.hpp"
#include "heights/poisson.hpp"
#include "photometry/blocks.hpp"

namespace gelslam {

using namespace surface::detail;

struct GradientSurfaces::Impl {
  Impl(cv::Size size, double pitch_mm)
      : poisson(size),
        leveler(size),
        pixel_pitch_mm(pitch_mm),
        border(cv::getStructuringElement(cv::MORPH_RECT,
                                         cv::Size(2 * (size.height / 48) + 1, 2 * (size.height / 48) + 1))) {}

  PoissonSolver poisson;
  BareGelLeveler leveler;
  double pixel_pitch_mm;
  cv::Mat border;
};

GradientSurfaces::GradientSurfaces(cv::Size size, double pixel_pitch_mm)
    : impl_(std::make_unique<Impl>(size, pixel_pitch_mm)) {}
GradientSurfaces::~GradientSurfaces() = default;

SurfacePtr GradientSurfaces::make(const cv::Mat1f& gx, const cv::Mat1f& gy, const cv::Mat1b& touched) {
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = impl_->pixel_pitch_mm;
  cv::Mat1f height_px = impl_->poisson.solve(gx, gy);
  // The gel moves beyond the contact, too.
  constexpr double kStillSlope = 0.02;
  cv::Mat1f slope;
  cv::magnitude(gx, gy, slope);
  cv::Mat1b disturbed;
  cv::compare(slope, kStillSlope, disturbed, cv::CMP_GT);
  cv::bitwise_or(disturbed, touched, disturbed);
  cv::Mat1b blocks;
  gather_blocks(disturbed, blocks);
  surface->zero_is_bare_gel = impl_->leveler.level(height_px, blocks, impl_->poisson).seen;
  surface->height_mm = impl_->poisson.pixels(height_px, static_cast<float>(impl_->pixel_pitch_mm));
  cv::erode(touched != 0, surface->contact, impl_->border);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  surface->normals = normals_from_gradient(gx, gy);
  surface->curvature = curvature_in_contact(gx, gy, surface->contact);
  return surface;
}

}  // namespace gelslam
