#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

#include "gelslam/fusion/fusion.hpp"

namespace gelslam::fusion::detail {

/// What one patch says about a point of the map.
struct Observation {
  float distance_mm =
      0;             ///< signed, along the surface's normal; positive outside the object (on the gel's side)
  float weight = 0;  ///< 0..1
  Eigen::Vector3f normal;  ///< of the surface, map frame, out of the object
  Eigen::Vector3f
      direction;  ///< halfway between `normal` and the way the sensor looks from: which side of the object
};

/// A keyframe's heights, weights and slopes over the box that holds its contact, ready for look-ups from the
/// map.
class Patch {
 public:
  /// Empty where the keyframe has no contact. `slope_gain` divides heights and slopes.
  static std::optional<Patch> prepare(const PosedSurface& posed, double slope_gain);

  /// What the patch says about `point_mm` (map frame); false when it shows nothing there, or only further
  /// away than `reach_mm`.
  bool observe(const Eigen::Vector3f& point_mm, float reach_mm, Observation& out) const {
    const Eigen::Vector3f p = sensor_R_map_ * point_mm + sensor_t_map_;
    const float u = p.x() * inverse_pitch_ + u_origin_;
    const float v = p.y() * inverse_pitch_ + v_origin_;
    if (!(u >= 0 && v >= 0 && u < u_end_ && v < v_end_)) return false;
    const int iu = static_cast<int>(u), iv = static_cast<int>(v);
    const float fu = u - static_cast<float>(iu), fv = v - static_cast<float>(iv);
    const Pixel* row = &pixels_[static_cast<std::size_t>(iv * width_ + iu)];
    const Pixel &a = row[0], &b = row[1], &c = row[width_], &d = row[width_ + 1];
    const float wa = (1 - fu) * (1 - fv), wb = fu * (1 - fv), wc = (1 - fu) * fv, wd = fu * fv;
    const float weight = wa * a.weight + wb * b.weight + wc * c.weight + wd * d.weight;
    if (weight < min_pixel_weight) return false;
    const float height = wa * a.height_mm + wb * b.height_mm + wc * c.height_mm + wd * d.height_mm;
    const float rise = height - p.z();
    const float nx = wa * a.nx + wb * b.nx + wc * c.nx + wd * d.nx;
    const float ny = wa * a.ny + wb * b.ny + wc * c.ny + wd * d.ny;
    const float nz = std::sqrt(std::fmax(1 - nx * nx - ny * ny, min_normal_z * min_normal_z));
    const float distance = rise * nz;
    if (std::fabs(distance) >= reach_mm) return false;
    out.distance_mm = distance;
    out.weight = weight - min_pixel_weight;  // begins at zero: no step where a patch begins
    out.normal = -(nx * x_axis_ + ny * y_axis_ + nz * z_axis_);
    out.direction = (out.normal - z_axis_) / std::sqrt(2 + 2 * nz);
    return true;
  }

  /// Visits the patch's pixels, every `stride`-th in both directions, that count: visit(point_mm, normal,
  /// weight) with point and outward normal in the map frame.
  template <typename Visit>
  void for_each_point(int stride, Visit&& visit) const {
    for (int v = 0; v < height_; v += stride) {
      for (int u = 0; u < width_; u += stride) {
        const Pixel& pixel = pixels_[static_cast<std::size_t>(v * width_ + u)];
        if (pixel.weight <= min_pixel_weight) continue;
        const Eigen::Vector3f p((static_cast<float>(u) - u_origin_) / inverse_pitch_,
                                (static_cast<float>(v) - v_origin_) / inverse_pitch_, pixel.height_mm);
        const float nz =
            std::sqrt(std::fmax(1 - pixel.nx * pixel.nx - pixel.ny * pixel.ny, min_normal_z * min_normal_z));
        visit(Eigen::Vector3f(origin_ + p.x() * x_axis_ + p.y() * y_axis_ + p.z() * z_axis_),
              Eigen::Vector3f(-(pixel.nx * x_axis_ + pixel.ny * y_axis_ + nz * z_axis_)),
              pixel.weight - min_pixel_weight);
      }
    }
  }

 private:
  static constexpr float min_pixel_weight = 0.05f;  ///< a pixel on the mask's very border
  static constexpr float min_normal_z = 0.05f;

  struct Pixel {
    float height_mm = 0, weight = 0, nx = 0, ny = 0;
  };

  Eigen::Matrix3f sensor_R_map_;
  Eigen::Vector3f sensor_t_map_, origin_, x_axis_, y_axis_, z_axis_;
  float inverse_pitch_ = 0, u_origin_ = 0, v_origin_ = 0, u_end_ = 0, v_end_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<Pixel> pixels_;
};

/// All patches with contact, in the given order. Throws Error on maps of unlike sizes and poses that are not
/// finite.
std::vector<Patch> prepare_patches(const std::vector<PosedSurface>& patches, double slope_gain, int threads);

}  // namespace gelslam::fusion::detail
