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

/// Observation of one patch at a point of the map.
struct Observation {
  /// Signed distance along the surface's normal; positive outside the object (on the side of the gel).
  float distance_mm = 0;
  float weight = 0;        ///< 0..1
  Eigen::Vector3f normal;  ///< Normal of the surface in the map frame, pointing out of the object.
  /// Direction halfway between `normal` and the direction toward the sensor. It decides to which side of the
  /// object the observation belongs.
  Eigen::Vector3f direction;
  int keyframe = 0;  ///< Keyframe of the patch.
};

/// Heights, weights and slopes of a keyframe over the box that contains its contact, for look-ups at points
/// of the map. A stored patch is small; its pixels are computed again when it is opened.
class Patch {
 public:
  /// Returns nothing if the keyframe has no contact. Heights and slopes are divided by `gradient_scale`.
  static std::optional<Patch> prepare(const PosedSurface& posed, double gradient_scale);

  /// Returns the patch at another pose, with the same pixels.
  Patch moved_to(const Pose& map_T_keyframe) const;

  /// Returns the patch with its pixels. Functions that look up pixels may be called only on such a patch.
  Patch opened() const;

  int keyframe() const { return keyframe_; }

  /// sqrt(W) at the border of the area that has weight (mask_weight()).
  static constexpr float kMinPixelWeight = 0.05f;

  /// Interpolated pixel values on the ray through a point, in the sensor's frame.
  struct Reading {
    float distance_mm = 0, weight = 0;  ///< as in Observation
    float nx = 0, ny = 0, nz = 1;       ///< Normal of the surface as measured, pointing out of the gel.
  };

  /// Evaluates the patch at `point_mm` (map frame). Returns false if the patch does not show that point, or
  /// if its distance exceeds `reach_mm`.
  bool read(const Eigen::Vector3f& point_mm, float reach_mm, Reading& out) const {
    const Eigen::Vector3f p = sensor_R_map_ * point_mm + sensor_t_map_;
    const float depth = 1 + p.z() * inverse_distance_;
    if (!(depth > 0)) return false;
    const float x = p.x() / depth, y = p.y() / depth;  // Rest coordinates of the point's ray.
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
    // The surface point lies on the ray at the interpolated height.
    out.distance_mm = rise * (out.nz + (out.nx * x + out.ny * y) * inverse_distance_);
    if (std::fabs(out.distance_mm) >= reach_mm) return false;
    // The weight begins at zero, so that the mean has no step where a patch begins.
    out.weight = weight - kMinPixelWeight;
    return true;
  }

  /// As read(), as an observation in the map frame.
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

  /// Returns a direction of the map in the sensor's frame; and the cosine between such a direction and
  /// Observation::direction of a reading.
  Eigen::Vector3f in_sensor(const Eigen::Vector3f& map_direction) const {
    return sensor_R_map_ * map_direction;
  }
  static float cosine(const Reading& r, const Eigen::Vector3f& sensor_direction) {
    const float along =
        r.nx * sensor_direction.x() + r.ny * sensor_direction.y() + (r.nz + 1) * sensor_direction.z();
    return -along / std::sqrt(2 + 2 * r.nz);
  }

  /// Calls visit(point_mm, normal) for every `stride`-th pixel in both directions that has weight, with the
  /// point and the outward normal in the map frame.
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

  /// The data from which the pixels are computed.
  struct Source {
    StoredSurface surface;
    double gradient_scale;
    /// Each entry takes up to 1.2 MB at 320x240 pixels. 256 is about the number of patches that overlap at a
    /// place that was touched often.
    LruCached<Pixels, 256> pixels;
  };

  Eigen::Matrix3f sensor_R_map_;
  Eigen::Vector3f sensor_t_map_, origin_, x_axis_, y_axis_, z_axis_;
  float inverse_pitch_ = 0, inverse_distance_ = 0, u_origin_ = 0, v_origin_ = 0, u_end_ = 0, v_end_ = 0;
  cv::Rect box_;
  int keyframe_ = 0;
  std::shared_ptr<Source> source_;
  std::shared_ptr<const Pixels> pixels_;  ///< null until opened
};

/// Opened patches that may contribute at a place.
using PatchList = std::vector<Patch>;

/// Throws Error when the surface is missing, its maps differ in size, or its pose is not finite.
void check_patch(const PosedSurface& posed);
/// Throws Error when the scale is not a positive, finite number.
void check_gradient_scale(double gradient_scale);

}  // namespace gelslam::fusion::detail
