#include "gelslam/surface/surface_estimator.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "change_mask.hpp"
#include "contact_mask.hpp"
#include "gelslam/core/error.hpp"
#include "gradient_map.hpp"
#include "poisson.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

constexpr double change_threshold_gray_levels = 2.0;
constexpr int change_margin_px = 5;
constexpr int min_side_px = 16;
constexpr float max_curvature = 0.7F;  // 1/pixel

std::string size_text(cv::Size size) { return std::to_string(size.width) + "x" + std::to_string(size.height); }

// Milliseconds since the last call.
class Stopwatch {
 public:
  double lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return elapsed;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  cv::Mat3f normals(gx.size());
  for (int v = 0; v < gx.rows; ++v) {
    const float* x = gx[v];
    const float* y = gy[v];
    float* out = normals[v]->val;
    for (int u = 0; u < gx.cols; ++u) {
      const float z = 1.0F / std::sqrt(1.0F + x[u] * x[u] + y[u] * y[u]);
      out[3 * u] = -x[u] * z;
      out[3 * u + 1] = -y[u] * z;
      out[3 * u + 2] = z;
    }
  }
  return normals;
}

void clip_curvature_to_contact(const cv::Mat1b& contact, cv::Mat1f& curvature) {
  for (int v = 0; v < curvature.rows; ++v) {
    const unsigned char* inside = contact[v];
    float* value = curvature[v];
    for (int u = 0; u < curvature.cols; ++u) {
      value[u] = inside[u] != 0 ? std::clamp(value[u], -max_curvature, max_curvature) : 0.0F;
    }
  }
}

const cv::Mat3b& checked_background(const cv::Mat3b& background) {
  if (background.rows < min_side_px || background.cols < min_side_px) {
    throw Error("background image is " + size_text(background.size()) + ", need at least 16x16");
  }
  return background;
}

}  // namespace

struct SurfaceEstimator::Impl {
  Impl(const GradientModel& model, const cv::Mat3b& background, const SurfaceOptions& surface_options)
      : options(surface_options),
        size(checked_background(background).size()),
        changes(background, change_threshold_gray_levels, change_margin_px),
        gradient(model, background),
        poisson(size),
        contact_detector(size, {options.color_dist_threshold, options.height_threshold_mm}),
        everywhere(size, static_cast<unsigned char>(255)) {}

  // Height in mm, 0 on the untouched gel.
  cv::Mat1f height_from_gradient() {
    const cv::Mat1f height_px = poisson.solve(gx, gy);
    const float level = untouched_level(height_px, changes.changed(), scratch);
    cv::Mat1f height_mm;
    height_px.convertTo(height_mm, CV_32F, options.pixel_pitch_mm, -options.pixel_pitch_mm * level);
    return height_mm;
  }

  SurfaceOptions options;
  cv::Size size;
  ChangeDetector changes;
  GradientMap gradient;
  PoissonSolver poisson;
  ContactDetector contact_detector;
  cv::Mat1b everywhere;
  cv::Mat1f gx, gy;
  std::vector<float> scratch;
  SurfaceTimings timings;
};

SurfaceEstimator::SurfaceEstimator(GradientModel model, const cv::Mat3b& background, const SurfaceOptions& options)
    : impl_(std::make_unique<Impl>(model, background, options)) {}
SurfaceEstimator::~SurfaceEstimator() = default;
SurfaceEstimator::SurfaceEstimator(SurfaceEstimator&&) noexcept = default;
SurfaceEstimator& SurfaceEstimator::operator=(SurfaceEstimator&&) noexcept = default;

SurfacePtr SurfaceEstimator::estimate(const cv::Mat3b& bgr) {
  Impl& self = *impl_;
  if (bgr.size() != self.size) {
    throw Error("image is " + size_text(bgr.size()) + " but the background is " + size_text(self.size));
  }
  Stopwatch watch;
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = self.options.pixel_pitch_mm;

  self.changes.detect(bgr);
  const cv::Mat1b& where = self.options.gradient_everywhere ? self.everywhere : self.changes.changed();
  self.gradient.compute(bgr, where, self.gx, self.gy);
  self.timings.gradient_ms = watch.lap_ms();

  surface->height_mm = self.height_from_gradient();
  self.timings.poisson_ms = watch.lap_ms();

  self.contact_detector.detect(self.changes.difference(), surface->height_mm, surface->contact);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  self.timings.contact_ms = watch.lap_ms();

  surface->normals = normals_from_gradient(self.gx, self.gy);
  cv::GaussianBlur(self.poisson.divergence(), surface->curvature, cv::Size(5, 5), 0.0);
  clip_curvature_to_contact(surface->contact, surface->curvature);
  self.timings.normals_ms = watch.lap_ms();
  return surface;
}

const SurfaceTimings& SurfaceEstimator::timings() const { return impl_->timings; }

}  // namespace gelslam
