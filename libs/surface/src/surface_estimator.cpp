// Computes the surface of the gel from a picture, as described in NormalFlow (Huang et al., RA-L 2024, §III)
// and docs/algorithms.md. The steps are: repair damaged pixels; convert the picture to the light of the
// background; find where it differs from the background; let the gradient model read the slopes there, minus
// those that it reads in the background; resample them to the rectified grid; integrate them (Poisson
// equation); correct the heights by the bare gel; find the contact; compute normals, confidence and
// curvature. Of these, the gradient model, the Poisson equation and the normals are as in the papers; the
// other steps are not in the papers, or differ from them.

#include "gelslam/surface/surface_estimator.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/slopes.hpp"
#include "heights/bare_gel.hpp"
#include "heights/contact_mask.hpp"
#include "heights/height_integrator.hpp"
#include "heights/normals.hpp"
#include "heights/rectified_grid.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"
#include "photometry/pixel_repair.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

// Measures the milliseconds since the last call.
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

const cv::Mat3b& checked_background(const cv::Mat3b& background) {
  constexpr int least_px = 4 * kBlockPx;
  if (std::min(background.rows, background.cols) < least_px)
    throw Error("background image is " + size_text(background.cols, background.rows) + ", need at least " +
                size_text(least_px, least_px));
  return background;
}

/// Returns the mean square per axis of the slopes that a model reads in the background, minus the slopes of
/// the domed gel: the squared error of the model on bare gel.
double mean_square_on_bare_gel(const GradientMap& gradient, const CameraModel& camera) {
  constexpr int kStepPx = 8;
  double squared = 0, count = 0;
  for (int v = kStepPx / 2; v < camera.size.height; v += kStepPx)
    for (int u = kStepPx / 2; u < camera.size.width; u += kStepPx, count += 2) {
      const Eigen::Vector2d rest_mm = camera.to_mm(camera.rectified_px(Eigen::Vector2d(u, v)));
      const Eigen::Vector2d read(gradient.background_gx()(v, u), gradient.background_gy()(v, u));
      squared += (read - camera.rest_slope(camera.rest_point_mm(rest_mm).head<2>())).squaredNorm();
    }
  return squared / count;
}

/// Returns Surface::slope_sigma_ratio, from the uncertainty that the model states and from the slopes that it
/// reads in the background. The latter are a measure of the error in contacts, too: networks of five sensors
/// read slopes of 0.03 to 0.05 on the bare gel of their own sensor, where the scale of their slopes is 2 to 6
/// % off; on other sensors they read 0.21 to 0.36, and the scale is 11 to 30 % off, differently over the gel.
/// The result is at least 1, because for a better model the smoothing by the gel is the larger error.
double slope_sigma_ratio_of(const SlopeUncertainty& uncertainty, const GradientMap& gradient,
                            const CameraModel& camera, double slope_noise_ratio) {
  const double stated = std::max(1.0, relative_sigma(uncertainty)),
               seen = mean_square_on_bare_gel(gradient, camera) /
                      (kBestSlopeSigmaRad * kBestSlopeSigmaRad * slope_noise_ratio * slope_noise_ratio);
  return std::sqrt(stated * stated + std::max(0.0, seen - 1));
}

}  // namespace

CameraModel camera_of(const GradientModel& model, cv::Size picture, const SurfaceOptions& options) {
  const SensorOptics optics = model.optics.value_or(options.optics);
  const std::string problem = why_impossible(optics, picture.width, picture.height, options.pixel_pitch_mm);
  if (!problem.empty()) throw Error("the sensor's optics: " + problem);
  return {picture, options.pixel_pitch_mm, optics};
}

// Holds the stages, their work buffers, and what is remembered of the last frame: its light and contact.
struct SurfaceEstimator::Impl {
  Impl(const GradientModel& model, const cv::Mat3b& background_image, const SurfaceOptions& surface_options)
      : options(surface_options),
        pixels(checked_background(background_image)),
        size(background_image.size()),
        background_blocks(average_blocks(pixels.background())),
        light_tracker(background_blocks, true),
        gradient(model, pixels.background()),
        slope_noise_ratio(gradient.slope_noise_ratio()),
        camera(camera_of(model, size, options)),
        rectified_grid(camera),
        integrator(camera),
        uncertainty(uncertainty_of(model, size, options.pixel_pitch_mm)),
        slope_sigma_ratio(slope_sigma_ratio_of(uncertainty, gradient, camera, slope_noise_ratio)),
        confidence(rectified_grid.resample(confidence_map(uncertainty, size))),
        leveler(camera, confidence, slope_noise_ratio, slope_sigma_ratio),
        contact_detector(options.pixel_pitch_mm),
        everywhere(all_blocks(size)) {}

  // Estimates the light, and computes `changed_blocks`, the blocks that differ from the background and whose
  // slopes have to be read, and `colors`, the table that converts gray levels to the background's light.
  // Returns the picture to which that table applies: `bgr` itself, or, if the light is uneven, a copy that is
  // converted already.
  const cv::Mat3b& find_changes(const cv::Mat3b& bgr) {
    averager.average(bgr, blocks);
    if (options.compensate_light) light = light_tracker.update(blocks, touched_blocks);
    to_background_light(light, blocks);
    cv::subtract(blocks, background_blocks, blocks);
    change_detector.detect(blocks, changed_blocks);
    colors = color_table(light.is_even() ? light : Light{});
    if (light.is_even()) return bgr;
    to_background_light(light, bgr, even);
    return even;
  }

  // Integrates the slopes and corrects the result by the bare gel. Returns the relief (see HeightIntegrator)
  // in mm, which is 0 on bare gel. Afterwards gx and gy are the gradient of the surface on the rectified
  // grid.
  cv::Mat1f relief_from_gradient() {
    gx = rectified_grid.resample(gx);
    gy = rectified_grid.resample(gy);
    changed = rectified_grid.resample_mask(changed_blocks);
    cv::Mat1f relief_px = integrator.solve(gx, gy);
    const BareGelLeveler::Result gel = leveler.level(relief_px, changed, integrator.solver());
    scatter_mm = gel.scatter_px * static_cast<float>(options.pixel_pitch_mm);
    bare_gel_seen = gel.seen;
    return integrator.relief_mm(relief_px);
  }

  // Finds the contact. `bend` is the divergence of the gradient. If the depth shows that the picture is not
  // one of a gel, all maps are set to zero.
  cv::Mat1b contact_of(cv::Mat1f& relief_mm, const cv::Mat1f& bend) {
    cv::Mat1b contact, changed_px(size);
    if (!bare_gel_seen) spread_blocks(changed, changed_px);
    contact_detector.detect(relief_mm, bend, changed_px,
                            {slope_noise_ratio, slope_sigma_ratio, scatter_mm, bare_gel_seen}, contact);
    rectified_grid.remove_beyond(contact);
    // In a real contact some block differs from the background by more than this many gray levels, which
    // correspond to a slope of 2 degrees. What remains of a change of light is smaller.
    constexpr float kMinLevels = 4;
    if (std::none_of(blocks.begin(), blocks.end(),
                     [](const cv::Vec3f& color) { return color.dot(color) > kMinLevels * kMinLevels; }))
      contact = 0;
    // No gel is thicker than this fraction of the shorter side of the picture. In a test picture of a camera,
    // for example, the mean depth is larger.
    constexpr double kThickest = 0.25;
    const double thickest_mm = kThickest * std::min(size.width, size.height) * options.pixel_pitch_mm;
    if (cv::mean(relief_mm, contact)[0] < -thickest_mm)
      for (cv::Mat* map : std::initializer_list<cv::Mat*>{&relief_mm, &gx, &gy, &contact}) map->setTo(0);
    return contact;
  }

  // Remembers the blocks of the contact with a margin. The light of the next frame is estimated without them.
  void remember_contact(const cv::Mat1b& contact) {
    cv::Mat1b contact_blocks;
    gather_blocks(contact, contact_blocks);
    cv::dilate(rectified_grid.raw_mask(contact_blocks), touched_blocks, contact_margin);
  }

  SurfaceOptions options;
  PixelRepair pixels;
  cv::Size size;
  cv::Mat3f background_blocks;
  LightTracker light_tracker;
  Light light;  // the light of the last picture
  GradientMap gradient;
  double slope_noise_ratio;
  CameraModel camera;
  RectifiedGrid rectified_grid;
  HeightIntegrator integrator;
  SlopeUncertainty uncertainty;
  double slope_sigma_ratio;
  cv::Mat1b confidence;  // the confidence that each pixel has if it is in contact and not steep
  BareGelLeveler leveler;
  ContactDetector contact_detector;
  BlockAverager averager;
  ChangeDetector change_detector;
  ColorTable colors{};
  cv::Mat3f blocks;   // the block means of the picture, then their difference to the background
  cv::Mat3b even;     // the picture converted to the background's light, if the light is uneven
  cv::Mat1b changed;  // changed_blocks, resampled to the rectified grid
  cv::Mat1b changed_blocks, touched_blocks, everywhere;
  cv::Mat contact_margin = cv::getStructuringElement(cv::MORPH_RECT, cv::Size(7, 7));
  cv::Mat1f gx, gy;
  float scatter_mm = 0.0F;
  bool bare_gel_seen = false;
  SurfaceTimings timings;
};

SurfaceEstimator::SurfaceEstimator(GradientModel model, const cv::Mat3b& background,
                                   const SurfaceOptions& options)
    : impl_(std::make_unique<Impl>(model, background, options)) {}
SurfaceEstimator::~SurfaceEstimator() = default;
SurfaceEstimator::SurfaceEstimator(SurfaceEstimator&&) noexcept = default;
SurfaceEstimator& SurfaceEstimator::operator=(SurfaceEstimator&&) noexcept = default;

SurfacePtr SurfaceEstimator::estimate(const cv::Mat3b& image) {
  Impl& self = *impl_;
  if (image.size() != self.size)
    throw Error("image is " + size_text(image.cols, image.rows) + " but the background is " +
                size_text(self.size.width, self.size.height));
  Stopwatch watch;
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = self.camera.pitch_mm;
  surface->optics = self.camera.optics;

  const cv::Mat3b& bgr = self.find_changes(self.pixels.clean(image));
  const cv::Mat1b& blocks = self.options.gradient_everywhere ? self.everywhere : self.changed_blocks;
  self.gradient.compute(bgr, self.colors, blocks, self.gx, self.gy);
  self.timings.gradient_ms = watch.lap_ms();

  surface->height_mm = self.relief_from_gradient();
  surface->zero_is_bare_gel = self.bare_gel_seen;
  self.timings.poisson_ms = watch.lap_ms();

  const cv::Mat1f bend = divergence(self.gx, self.gy);
  surface->contact = self.contact_of(surface->height_mm, bend);
  self.integrator.to_height(surface->height_mm);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  surface->slope_sigma_ratio = static_cast<float>(self.slope_sigma_ratio);  // rounded as in PackedSurface
  surface->slope_noise_ratio = static_cast<float>(self.slope_noise_ratio);
  surface->confidence = cv::Mat1b::zeros(self.size);
  self.confidence.copyTo(surface->confidence, surface->contact);
  cv::Mat1b unread;
  if (const cv::Mat1b& covered = self.pixels.covered(); !covered.empty()) {
    // Curvature and the gradients of the normals are differences between neighbors, so one more pixel around
    // the interpolated ones counts as unread.
    cv::dilate(self.rectified_grid.resample(covered) > 0, unread, cv::Mat());
    surface->confidence.setTo(1, unread & surface->contact);
  }
  self.remember_contact(surface->contact);
  self.timings.contact_ms = watch.lap_ms();

  surface->normals = normals_from_gradient(self.gx, self.gy);
  lower_steep_confidence(surface->normals, surface->confidence);
  surface->curvature = curvature_in_contact(bend, surface->contact, surface->pixel_pitch_mm, unread);
  self.timings.normals_ms = watch.lap_ms();
  return surface;
}

bool SurfaceEstimator::light_is_followed() const { return impl_->light_tracker.is_followed(); }
const SurfaceTimings& SurfaceEstimator::timings() const { return impl_->timings; }

}  // namespace gelslam
