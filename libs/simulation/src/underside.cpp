// The height of an object's lowest surface above each pixel, by casting rays along the sensor's z axis. Full
// searches are made on a coarse grid of rays. Where these agree, the rays between them start from an
// interpolated guess and fall back to a full search if that fails.

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "gelslam/simulation/gel.hpp"

namespace gelslam {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr auto kDepthMm = static_cast<float>(kMaxIndentationMm);
constexpr int kTilePx = 8;  // Tiles that are far from the object are skipped.
// Full searches are made for the rays on this coarser grid; the rays between them start from an interpolated
// guess.
constexpr int kNodeStep = 4;
// Rays end slightly above the gel at rest, so that the edge of a contact is included.
constexpr float kAboveGelMm = 0.02F;
// If the nodes of a cell differ by less than this, they are on one sheet of the surface.
constexpr float kSmoothEnoughMm = 0.15F;

/// Casts the rays of one image along the sensor's +z axis, from the deepest indentation to just above the
/// gel.
class Caster {
 public:
  Caster(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry)
      : shape_(shape),
        object_R_sensor_(sensor_T_object.linear().transpose().cast<float>()),
        object_p_sensor_(sensor_T_object.inverse(Eigen::Isometry).translation().cast<float>()),
        geometry_(geometry),
        direction_(object_R_sensor_.col(2)),
        length_(kDepthMm + static_cast<float>(geometry.highest_rest_mm()) + kAboveGelMm),
        starts_(cells(geometry.height_px, kTilePx), cells(geometry.width_px, kTilePx)),
        nodes_(cells(geometry.height_px, kNodeStep) + 1, cells(geometry.width_px, kNodeStep) + 1) {}

  cv::Mat1f cast() {
    for (int j = 0; j < starts_.rows; ++j)
      for (int i = 0; i < starts_.cols; ++i) starts_(j, i) = clear_start(i * kTilePx, j * kTilePx);
    for (int j = 0; j < nodes_.rows; ++j)
      for (int i = 0; i < nodes_.cols; ++i) nodes_(j, i) = search(i * kNodeStep, j * kNodeStep);
    cv::Mat1f underside(geometry_.height_px, geometry_.width_px);
    for (int v = 0; v < underside.rows; ++v)
      for (int u = 0; u < underside.cols; ++u) underside(v, u) = distance(u, v) - kDepthMm;
    return underside;
  }

 private:
  static int cells(int pixels, int step) { return (pixels + step - 1) / step; }

  Eigen::Vector3f origin(float x, float y) const {
    return object_R_sensor_ * Eigen::Vector3f(x, y, -kDepthMm) + object_p_sensor_;
  }
  Eigen::Vector3f origin(int u, int v) const { return origin(geometry_.x_mm(u), geometry_.y_mm(v)); }

  /// Returns how far all rays of a tile can go without meeting the object; infinity if they meet it nowhere.
  float clear_start(int u, int v) const {
    const float pitch = static_cast<float>(geometry_.pixel_pitch_mm);
    const float half = 0.5F * pitch * (kTilePx + 1) * 1.4143F;
    const float to_center = 0.5F * pitch * (kTilePx - 1);
    const Eigen::Vector3f center = origin(geometry_.x_mm(u) + to_center, geometry_.y_mm(v) + to_center);
    float start = 0;
    for (float clear = shape_.clearance(center); clear > half + 0.01F;
         clear = shape_.clearance(center + start * direction_)) {
      start += clear - half;
      if (start >= length_) return kInfinity;
    }
    return start;
  }

  float search(int u, int v) const {
    const float start =
        starts_(std::min(v / kTilePx, starts_.rows - 1), std::min(u / kTilePx, starts_.cols - 1));
    if (start == kInfinity) return kInfinity;
    return start + shape_.intersect(origin(u, v) + start * direction_, direction_, length_ - start);
  }

  float distance(int u, int v) const {
    const int i = u / kNodeStep, j = v / kNodeStep, du = u % kNodeStep, dv = v % kNodeStep;
    if (du == 0 && dv == 0) return nodes_(j, i);
    const float a = nodes_(j, i), b = nodes_(j, i + 1), c = nodes_(j + 1, i), d = nodes_(j + 1, i + 1);
    const float low = std::min({a, b, c, d}), high = std::max({a, b, c, d});
    if (!(high - low < kSmoothEnoughMm)) return search(u, v);
    const float fu = static_cast<float>(du) / kNodeStep, fv = static_cast<float>(dv) / kNodeStep;
    const float guess = (1 - fv) * ((1 - fu) * a + fu * b) + fv * ((1 - fu) * c + fu * d);
    const float near = shape_.intersect_near(origin(u, v), direction_, guess);
    // A point beyond the ray's end counts as a miss, as it does in a search; a point before its start counts
    // as a hit at the start.
    if (!std::isnan(near)) return near > length_ ? kInfinity : std::max(near, 0.0F);
    return search(u, v);
  }

  const Shape& shape_;
  Eigen::Matrix3f object_R_sensor_;
  Eigen::Vector3f object_p_sensor_;
  const SensorGeometry& geometry_;
  Eigen::Vector3f direction_;
  float length_;
  cv::Mat1f starts_, nodes_;
};

}  // namespace

cv::Mat1f object_underside(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry) {
  return Caster(shape, sensor_T_object, geometry).cast();
}

std::optional<Pose> settle_object(const Shape& shape, Pose sensor_T_object, double indentation_mm,
                                  const SensorGeometry& geometry) {
  constexpr int kCoarser = 4;
  constexpr double kLiftMm = 0.5, kCloseEnoughMm = 1e-3;
  const SensorGeometry view{geometry.width_px / kCoarser, geometry.height_px / kCoarser,
                            geometry.pixel_pitch_mm * kCoarser};
  for (int attempt = 0; attempt < 40; ++attempt) {
    double lowest = 0;
    cv::minMaxLoc(object_underside(shape, sensor_T_object, view), &lowest);
    const bool clamped = lowest <= -kMaxIndentationMm, nothing = !std::isfinite(lowest);
    const double step = clamped ? kLiftMm : nothing ? -kLiftMm : -indentation_mm - lowest;
    sensor_T_object.translation().z() += step;
    if (!clamped && !nothing && std::abs(step) < kCloseEnoughMm) return sensor_T_object;
  }
  return std::nullopt;
}

}  // namespace gelslam
