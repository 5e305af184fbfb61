// The camera's rays: they start at a point below the gel, or run along z for an orthographic camera, and pass
// the lens to the gel.

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/simulation/optics.hpp"

namespace gelslam {
namespace {

double magnified(double radius, double k1) { return radius * (1 + k1 * radius * radius); }

/// Returns the radius before the lens of a ray that appears at `image_radius`, by bisection. If a lens with
/// negative k1 shows no such ray, it returns the largest radius that the lens shows.
double before_lens(double image_radius, double k1) {
  constexpr int kHalvings = 50;
  double near = 0, far = k1 < 0 ? std::sqrt(-1 / (3 * k1)) : image_radius;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (near + far);
    (magnified(middle, k1) < image_radius ? near : far) = middle;
  }
  return 0.5 * (near + far);
}

double bilinear(const cv::Mat1f& map, double u, double v) {
  u = std::clamp(u, 0.0, map.cols - 1.0);
  v = std::clamp(v, 0.0, map.rows - 1.0);
  const int x = std::min(static_cast<int>(u), map.cols - 2), y = std::min(static_cast<int>(v), map.rows - 2);
  const float* above = &map(y, x);
  const float* below = &map(y + 1, x);
  const double du = u - x, dv = v - y;
  const double top = above[0] + du * static_cast<double>(above[1] - above[0]);
  return top + dv * (below[0] + du * static_cast<double>(below[1] - below[0]) - top);
}

/// Returns the height at which a ray that rises from below first meets the surface. `below_mm(z)` is how far
/// the ray at height z is below the surface. The steps are small enough that no detail of the size of a pixel
/// is skipped.
template <typename Below>
double first_crossing_mm(const Below& below_mm, double lowest_mm, double highest_mm, int steps) {
  double low = lowest_mm, high = highest_mm, below_low = below_mm(low), below_high = 0;
  for (int step = 1; step <= steps; ++step) {
    high = lowest_mm + (highest_mm - lowest_mm) * step / steps;
    below_high = below_mm(high);
    if (below_high <= 0) break;
    low = high;
    below_low = below_high;
  }
  constexpr double kExactMm = 1e-5;
  for (int k = 0; k < 20 && high - low > kExactMm && below_low > below_high; ++k) {
    // Regula falsi, with both ends of the bracket moving, as the function is not linear.
    const double at = std::clamp(low + (high - low) * below_low / (below_low - below_high), low, high);
    const double below = below_mm(at);
    if (std::abs(below) < kExactMm) return at;
    (below > 0 ? low : high) = at;
    (below > 0 ? below_low : below_high) = below;
  }
  return 0.5 * (low + high);
}

}  // namespace

void Optics::trace_to_plane() {
  constexpr int kBlockPx = 8;  // press_gel() requires sizes that are multiples of this.
  const SensorGeometry& camera = geometry_;
  const SensorOptics& optics = camera.optics;
  plane_mm_.create(camera.height_px, camera.width_px);
  const double half_width_px = 0.5 * camera.width_px, stretch = std::sqrt(optics.pixel_aspect);
  double beyond_mm = 0;
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      const double from_axis_u = u - (half_width_px - 0.5 + optics.lens_center_px[0]),
                   from_axis_v = v - (0.5 * camera.height_px - 0.5 + optics.lens_center_px[1]);
      const double image_radius = std::hypot(from_axis_u, from_axis_v) / half_width_px;
      const double shrink = image_radius > 0 ? before_lens(image_radius, optics.lens_k1) / image_radius : 1;
      const double x = shrink * from_axis_u / stretch * camera.pixel_pitch_mm,
                   y = shrink * from_axis_v * stretch * camera.pixel_pitch_mm;
      plane_mm_(v, u) = {x, y};
      beyond_mm =
          std::max({beyond_mm, std::abs(x) - camera.half_width_mm(), std::abs(y) - camera.half_height_mm()});
    }
  const int blocks = static_cast<int>(std::ceil(beyond_mm / camera.pixel_pitch_mm / kBlockPx));
  gel_grid_.width_px += 2 * kBlockPx * blocks;
  gel_grid_.height_px += 2 * kBlockPx * blocks;
}

bool Optics::is_orthographic() const {
  return !geometry_.optics.has_lens() && geometry_.optics.camera_distance_mm == 0;
}

/// Returns, for each ray, the grid position of the first point of the gel's surface that it meets.
cv::Mat2f Optics::seen_px(const cv::Mat1f& height_mm) const {
  double lowest = 0, highest = 0;
  cv::minMaxLoc(height_mm, &lowest, &highest);
  const double per_mm = 1 / geometry_.pixel_pitch_mm, inverse_distance = geometry_.optics.inverse_distance();
  const double middle_u = 0.5 * gel_grid_.width_px - 0.5, middle_v = 0.5 * gel_grid_.height_px - 0.5;
  cv::Mat2f seen(plane_mm_.size());
  for (int v = 0; v < seen.rows; ++v)
    for (int u = 0; u < seen.cols; ++u) {
      if (is_orthographic()) {
        seen(v, u) = {static_cast<float>(u), static_cast<float>(v)};
        continue;
      }
      const cv::Vec2d per_scale = plane_mm_(v, u) * per_mm;
      const auto at = [&](double z) -> cv::Vec2d {
        const double scale = 1 + z * inverse_distance;
        return {scale * per_scale[0] + middle_u, scale * per_scale[1] + middle_v};
      };
      const auto below = [&](double z) {
        const cv::Vec2d px = at(z);
        return bilinear(height_mm, px[0], px[1]) - z;
      };
      const double sideways_px = cv::norm(per_scale) * inverse_distance * (highest - lowest);
      const double z = first_crossing_mm(below, lowest, highest, 1 + static_cast<int>(sideways_px));
      seen(v, u) = at(z);
    }
  return seen;
}

GelView Optics::view(const GelShape& gel) const {
  if (gel.slope.size() != cv::Size(gel_grid_.width_px, gel_grid_.height_px))
    throw Error("the gel's size is not the sensor's");
  const cv::Mat2f place_px = seen_px(gel.height_mm);
  return {place_px, taken(gel.slope, place_px)};
}

cv::Mat Optics::taken(const cv::Mat& map, const cv::Mat2f& place_px) const {
  if (is_orthographic()) return map;
  cv::Mat result;
  cv::remap(map, result, place_px, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return result;
}

Eigen::Vector2d Optics::image_px(const Eigen::Vector3d& point_mm) const {
  const SensorOptics& optics = geometry_.optics;
  const double half_width_px = 0.5 * geometry_.width_px, stretch = std::sqrt(optics.pixel_aspect);
  // Perspective projection, then the lens distortion.
  const double nearer = 1 / (1 + point_mm.z() * optics.inverse_distance());
  const Eigen::Vector2d image =
      nearer * Eigen::Vector2d(point_mm.x() * stretch, point_mm.y() / stretch) / geometry_.pixel_pitch_mm;
  const double radius = image.norm() / half_width_px;
  const double magnification = 1 + optics.lens_k1 * radius * radius;
  return magnification * image + Eigen::Vector2d(half_width_px - 0.5 + optics.lens_center_px[0],
                                                 0.5 * geometry_.height_px - 0.5 + optics.lens_center_px[1]);
}

}  // namespace gelslam
