#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/core/lru_cached.hpp"
#include "gelslam/fusion/fusion.hpp"

namespace gelslam::fusion::detail {

/// What one patch says about a point of the map.
struct Observation {
  /// signed, along the surface's normal; positive outside the object (on the gel's side)
  float distance_mm = 0;
  float weight = 0;           ///< 0..1
  Eigen::Vector3f normal;     ///< of the surface, map frame, out of the object
  Eigen::Vector3f direction;  ///< halfway between `normal` and where the sensor looks from: the object's side
  int keyframe = 0;           ///< whose patch it is
};

/// A keyframe's heights, weights and slopes over the box that holds its contact, for look-ups from the map.
/// What is kept of it is small: its pixels are made again when it is opened.
class Patch {
 public:
  /// Empty where the keyframe has no contact. `gradient_scale` divides heights and slopes.
  static std::optional<Patch> prepare(const PosedSurface& posed, double gradient_scale);

  /// The same patch elsewhere; both share the pixels.
  Patch moved_to(const Pose& map_T_keyframe) const;

  /// The patch with its pixels, which only such a one can be asked for.
  Patch opened() const;

  int keyframe() const { return keyframe_; }

  static constexpr float kMinPixelWeight = 0.05f;  ///< sqrt(W) on the mask's very border, mask_weight()

  /// What the pixels at a point's foot say, in the sensor's frame.
  struct Reading {
    float distance_mm = 0, weight = 0;  ///< as in Observation
    float nx = 0, ny = 0, nz = 1;       ///< the surface's normal, as measured: out of the gel
  };

  /// False when the patch shows nothing at `point_mm` (map frame), or only further away than `reach_mm`.
  bool read(const Eigen::Vector3f& point_mm, float reach_mm, Reading& out) const {
    const Eigen::Vector3f p = sensor_R_map_ * point_mm + sensor_t_map_;
    const float depth = 1 + p.z() * inverse_distance_;
    if (!(depth > 0)) return false;
    const float x = p.x() / depth, y = p.y() / depth;  // rest coordinates
    const float u = x * inverse_pitch_ + u_origin_;
    const float v = y * inverse_pitch_ + v_origin_;
    if (!(u >= 0 && v >= 0 && u < u_end_ && v < v_end_)) return false;
    const int iu = static_cast<int>(u), iv = static_cast<int>(v);
    const float fu = u - static_cast<float>(iu), fv = v - static_cast<float>(iv);
    const Pixel* row = pixels_->data() + (iv * box_.width + iu);
    const Pixel &a = row[0], &b = row[1], &c = row[box_.width], &d = row[box_.width + 1];
    const float wa = (1 - fu) * (1 - fv), wb = fu * (1 - fv), wc = (1 - fu) * fv, wd = fu * fv;
    const float weight = wa * a.weight + wb * b.weight + wc * c.weight + wd * d.weight;
    if (weight < kMinPixelWeight) return false;
    const float height = wa * a.height_mm + wb * b.height_mm + wc * c.height_mm + wd * d.height_mm;
    const float rise = height - p.z();
    out.nx = wa * a.nx + wb * b.nx + wc * c.nx + wd * d.nx;
    out.ny = wa * a.ny + wb * b.ny + wc * c.ny + wd * d.ny;
    out.nz = std::sqrt(std::max(1 - out.nx * out.nx - out.ny * out.ny, kMinNormalZ * kMinNormalZ));
    // The surface lies on the ray at that height.
    out.distance_mm = rise * (out.nz + (out.nx * x + out.ny * y) * inverse_distance_);
    if (std::fabs(out.distance_mm) >= reach_mm) return false;
    out.weight = weight - kMinPixelWeight;  // begins at zero: no step where a patch begins
    return true;
  }

  /// The same as an observation in the map frame.
  bool observe(const Eigen::Vector3f& point_mm, float reach_mm, Observation& out) const {
    Reading reading;
    if (!read(point_mm, reach_mm, reading)) return false;
    out.distance_mm = reading.distance_mm;
    out.weight = reading.weight;
    out.normal = -(reading.nx * x_axis_ + reading.ny * y_axis_ + reading.nz * z_axis_);
    out.direction = (out.normal - z_axis_) / std::sqrt(2 + 2 * reading.nz);
    out.keyframe = keyframe_;
    return true;
  }

  /// A direction of the map in the sensor's frame, and the cosine between it and a reading's
  /// Observation::direction.
  Eigen::Vector3f in_sensor(const Eigen::Vector3f& map_direction) const {
    return sensor_R_map_ * map_direction;
  }
  static float cosine(const Reading& r, const Eigen::Vector3f& sensor_direction) {
    const float along =
        r.nx * sensor_direction.x() + r.ny * sensor_direction.y() + (r.nz + 1) * sensor_direction.z();
    return -along / std::sqrt(2 + 2 * r.nz);
  }

  /// Visits the patch's pixels, every `stride`-th in both directions, that count: visit(point_mm, normal)
  /// with point and outward normal in the map frame.
  template <typename Visit>
  void for_each_point(int stride, Visit&& visit) const {
    for (int v = 0; v < box_.height; v += stride) {
      for (int u = 0; u < box_.width; u += stride) {
        const Pixel& pixel = (*pixels_)[static_cast<std::size_t>(v * box_.width + u)];
        if (pixel.weight <= kMinPixelWeight) continue;
        const float stretch = 1 + pixel.height_mm * inverse_distance_;
        const Eigen::Vector3f p(stretch * ((static_cast<float>(u) - u_origin_) / inverse_pitch_),
                                stretch * ((static_cast<float>(v) - v_origin_) / inverse_pitch_),
                                pixel.height_mm);
        const float nz =
            std::sqrt(std::max(1 - pixel.nx * pixel.nx - pixel.ny * pixel.ny, kMinNormalZ * kMinNormalZ));
        visit(Eigen::Vector3f(origin_ + p.x() * x_axis_ + p.y() * y_axis_ + p.z() * z_axis_),
              Eigen::Vector3f(-(pixel.nx * x_axis_ + pixel.ny * y_axis_ + nz * z_axis_)));
      }
    }
  }

 private:
  void set_pose(const Pose& map_T_keyframe);

  static constexpr float kMinNormalZ = 0.05f;

  struct Pixel {
    float height_mm = 0, weight = 0, nx = 0, ny = 0;
  };
  using Pixels = std::vector<Pixel>;
  static Pixels make_pixels(const Surface& surface, const cv::Rect& box, double gradient_scale);

  /// What pixels are made of.
  struct Source {
    StoredSurface surface;
    double gradient_scale;
    LruCached<Pixels, 256> pixels;  ///< up to 1.2 MB each at 320x240: as many as meet around a dense place
  };

  Eigen::Matrix3f sensor_R_map_;
  Eigen::Vector3f sensor_t_map_, origin_, x_axis_, y_axis_, z_axis_;
  float inverse_pitch_ = 0, inverse_distance_ = 0, u_origin_ = 0, v_origin_ = 0, u_end_ = 0, v_end_ = 0;
  cv::Rect box_;
  int keyframe_ = 0;
  std::shared_ptr<Source> source_;
  std::shared_ptr<const Pixels> pixels_;  ///< null until opened
};

/// The patches that are asked at a place, opened.
using PatchList = std::vector<Patch>;

/// Throws Error when the surface is missing, its maps differ in size, or its pose is not finite.
void check_patch(const PosedSurface& posed);
/// Throws Error when it is not a positive number.
void check_gradient_scale(double gradient_scale);

}  // namespace gelslam::fusion::detail
