#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gelslam::registration::detail {

/// The number of parameters of the motion: rx ry rz tx ty (rad, mm), in this order. Normals hardly depend on
/// tz, which only moves pixels toward the center of the picture.
inline constexpr int kParameters = 5;
inline constexpr int kHessianEntries = kParameters * (kParameters + 1) / 2;
inline constexpr float kMinFacing = 0.2f;  // limits the Jacobian where a surface is seen edge on

/// The samples of a reference as a structure of arrays, so that loops over them can be vectorized.
struct Samples {
  std::vector<float> x, y, z, nx, ny, nz;  ///< points (mm) and unit normals in the reference frame
  /// Surface::confidence / 255, times a factor that falls toward the border of the contact.
  std::vector<float> weight;
  /// The derivatives of the components x, y, z of the normal by x of the rest coordinates, then by y, in
  /// 1/mm.
  std::array<std::vector<float>, 6> gradient;

  int size() const { return static_cast<int>(x.size()); }
  void resize(std::size_t count);
};

/// How the camera of the target sees the samples, in the axes of the reference. The ray through a point q has
/// the direction q * inverse_distance + axis. For the camera of the reference itself the axis is (0, 0, 1).
struct Viewpoint {
  /// The inverse of the distance of both cameras from the plane z = 0, in 1/mm; 0 if they are orthographic.
  float inverse_distance = 0;
  std::array<float, 3> axis{0, 0, 1};
  /// The point about which rx and ry rotate: the center of the shared contact, where the heights determine z.
  /// If they rotated about the origin of the sensor, a contact far from it would move along z, and an error
  /// of the scale would be taken for a rotation.
  float center_x_mm = 0, center_y_mm = 0;

  /// Returns the tz by which rotations rx and ry about the origin have to be completed, so that they rotate
  /// about the center.
  double tz_of_turn(double rx, double ry) const {
    return ry * static_cast<double>(center_x_mm) - rx * static_cast<double>(center_y_mm);
  }
};

/// The derivatives of the rest coordinates x and y in the reference's picture by the five parameters, for the
/// point at which the ray of the target's camera that sees a sample meets the moved surface (the matrix M_k
/// in docs/algorithms.md).
struct PictureMotion {
  std::array<float, kParameters> x, y;
};

inline __attribute__((always_inline)) PictureMotion picture_motion(const Samples& s, std::size_t k,
                                                                   const Viewpoint& view) {
  const float x = s.x[k], y = s.y[k], z = s.z[k], nx = s.nx[k], ny = s.ny[k], nz = s.nz[k],
              inverse_distance = view.inverse_distance;
  const float shrink = 1.0f / (1.0f + z * inverse_distance);
  const float own_x = x * shrink * inverse_distance, own_y = y * shrink * inverse_distance;
  const float depth = 1.0f / (z * inverse_distance + view.axis[2]);
  const float ray_x = (x * inverse_distance + view.axis[0]) * depth,
              ray_y = (y * inverse_distance + view.axis[1]) * depth;
  const float facing = nx * ray_x + ny * ray_y + nz;
  const float along = 1.0f / (facing > kMinFacing ? facing : kMinFacing);
  const float dx = x - view.center_x_mm, dy = y - view.center_y_mm;
  // The motion of the sample in space by the five parameters.
  const float moved_x[kParameters] = {0, z, -y, 1, 0}, moved_y[kParameters] = {-z, 0, x, 0, 1},
              moved_z[kParameters] = {dy, -dx, 0, 0, 0};
  PictureMotion motion;
  for (std::size_t a = 0; a < kParameters; ++a) {
    const float back = (nx * moved_x[a] + ny * moved_y[a] + nz * moved_z[a]) * along;
    motion.x[a] = shrink * (moved_x[a] - own_x * moved_z[a] - (ray_x - own_x) * back);
    motion.y[a] = shrink * (moved_y[a] - own_y * moved_z[a] - (ray_y - own_y) * back);
  }
  return motion;
}

/// The maps of a target that warp_residuals() needs, both continuous in memory.
struct TargetView {
  int width = 0, height = 0;
  float inverse_pitch_per_mm = 0;
  float inverse_distance = 0;              ///< the inverse of the camera's distance, 1/mm
  float center_u_px = 0, center_v_px = 0;  ///< pixel coordinates of the sensor's origin
  const float* normals = nullptr;          ///< width * height * 3
  /// width * height values of Surface::confidence, or of the contact if there is no confidence.
  const std::uint8_t* confidence = nullptr;
};

/// The residuals of all samples at one pose, as a structure of arrays.
struct Residuals {
  std::vector<float> rx, ry, rz;
  /// The information of the difference between two normals, shared_confidence(), later times the robust
  /// weight. It is 0 where a sample does not fall on contact of the target.
  std::vector<float> weight;
  void resize(std::size_t count);
};

/// Computes for every sample the residual r = Rᵀ n'(π(R q + t)) - n, where n' are the normals of the target
/// and π is CameraModel::project(). `rotation`: R, row-major 3x3; `translation`: t in mm.
void warp_residuals(const Samples& samples, const TargetView& target, const float* rotation,
                    const float* translation, Residuals& residuals);

/// Multiplies each weight by the Cauchy weight of its residual, 1 / (1 + |r|² / scale²).
void apply_robust_weights(Residuals& residuals, float scale);

struct ResidualSums {
  float squares = 0;  ///< Σ w |r|²
  float weight = 0;   ///< Σ w
};
ResidualSums sum_residuals(const Residuals& residuals);

/// Returns the weighted center of the samples in mm in the reference frame, or (0, 0, 0) if none has a
/// weight.
std::array<float, 3> shared_center_mm(const Samples& samples, const Residuals& residuals);

/// Computes the normal equations: gradient = Σ w Jᵀ r (5 numbers) and hessian = Σ w JᵀJ (15 numbers, the
/// upper triangle row by row), where J are the derivatives of a sample's normal by the five parameters.
void accumulate_normal_equations(const Samples& samples, const Viewpoint& view, const Residuals& residuals,
                                 double* gradient, double* hessian);

}  // namespace gelslam::registration::detail
