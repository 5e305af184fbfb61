#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gelslam::registration::detail {

/// The columns of the Jacobian are rx ry rz tx ty. Normals hardly show tz: it only moves pixels toward the
/// picture's center.
inline constexpr int kParameters = 5;
inline constexpr int kHessianEntries = kParameters * (kParameters + 1) / 2;
inline constexpr float kMinFacing = 0.2f;  // Bounds the Jacobian where a surface is seen edge on.

/// Reference samples as structure of arrays, so that the loops below vectorise. Lengths in mm, normals unit.
struct Samples {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<float> weight;  ///< information of the normal, Surface::confidence / 255
  /// How each of the normal's components x, y, z changes per mm along x of the picture's rest coordinates,
  /// then along y.
  std::array<std::vector<float>, 6> gradient;

  int size() const { return static_cast<int>(x.size()); }
  void resize(std::size_t count);
};

/// How the target's camera sees the samples, in the reference's axes. The ray through a point q has the
/// direction q / distance + axis; the reference's own camera has the axis (0, 0, 1).
struct Viewpoint {
  float inverse_distance = 0;  ///< of both cameras, 1/mm; 0: parallel rays
  std::array<float, 3> axis{0, 0, 1};
  /// The point about which rx and ry rotate: the center of the shared contact, whose z the heights measure.
  /// If the object were rotated about the sensor's origin instead, a rotation would move a contact that is
  /// far from the sensor's axis along z, and an error of the scale would be taken for a rotation.
  float center_x_mm = 0, center_y_mm = 0;

  /// Returns the tz that goes with the turns rx and ry.
  double tz_of_turn(double rx, double ry) const {
    return ry * static_cast<double>(center_x_mm) - rx * static_cast<double>(center_y_mm);
  }
};

/// The derivatives of a sample's place in the reference's picture (rest coordinates x and y) by the five
/// parameters. The place is where the ray that sees the moved sample meets the surface.
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
  // These are the motions of the sample, with turns about the center.
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

/// A target frame as warp_residuals() reads it; both maps are continuous.
struct TargetView {
  int width = 0, height = 0;
  float inverse_pitch_per_mm = 0;
  float inverse_distance = 0;              ///< of the camera, 1/mm
  float center_u_px = 0, center_v_px = 0;  ///< pixel coordinates of the sensor's origin
  const float* normals = nullptr;          ///< width * height * 3
  /// width * height values of Surface::confidence, or of the contact where all of it is known equally well.
  const std::uint8_t* confidence = nullptr;
};

/// Residuals of one warp, structure of arrays, as long as the samples.
struct Residuals {
  std::vector<float> rx, ry, rz;
  /// Information of the difference of two normals, relative to the best: 0 where a sample leaves the target's
  /// contact.
  std::vector<float> weight;
  void resize(std::size_t count);
};

/// Computes r = Rᵀ n'(π(R q + t)) - n for every sample, π: CameraModel::project() (`rotation` row-major 3x3,
/// translation in mm).
void warp_residuals(const Samples& samples, const TargetView& target, const float* rotation,
                    const float* translation, Residuals& residuals);

/// Multiplies each weight by a Cauchy weight of its residual's size: 1 / (1 + |r|² / scale²).
void apply_robust_weights(Residuals& residuals, float scale);

struct ResidualSums {
  float squares = 0;  ///< Σ w |r|²
  float weight = 0;   ///< Σ w
};
ResidualSums sum_residuals(const Residuals& residuals);

/// Returns the weighted center of the samples, or the origin where none has weight.
std::array<float, 3> shared_center_mm(const Samples& samples, const Residuals& residuals);

/// Computes gradient = Σ w Jᵀ r (5), hessian = Σ w JᵀJ (15, upper triangle), J: how a sample's normal changes
/// with the five parameters.
void accumulate_normal_equations(const Samples& samples, const Viewpoint& view, const Residuals& residuals,
                                 double* gradient, double* hessian);

}  // namespace gelslam::registration::detail
