#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gelslam::registration::detail {

/// Jacobian columns: rx ry rz tx ty. Normals hardly show tz: it only moves pixels toward the picture's
/// center.
inline constexpr int kParameters = 5;
inline constexpr int kHessianEntries = kParameters * (kParameters + 1) / 2;

/// Reference samples as structure of arrays, so that the loops below vectorise. Lengths in mm, normals unit.
struct Samples {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<float>
      weight;  ///< how far to trust the sample, 0..1 (the contact's border is the gel's membrane rim)
  std::array<std::vector<float>, 3 * kParameters> jacobian;  ///< row-major 3x5, one array per entry
  std::array<std::vector<float>, kHessianEntries> hessian;  ///< upper triangle of JᵀJ per sample, row by row

  float inverse_distance = 0;  ///< of the reference's camera, 1/mm
  float center_x_mm = 0,
        center_y_mm = 0;  ///< mean of the points, about which rx and ry turn: see tz_of_turn()

  int size() const { return static_cast<int>(x.size()); }
  void resize(std::size_t count);
};

/// A target frame as warp_residuals() reads it; both maps are continuous.
struct TargetView {
  int width = 0, height = 0;
  float inverse_pitch_per_mm = 0;
  float inverse_distance = 0;              ///< of the camera, 1/mm
  float center_u_px = 0, center_v_px = 0;  ///< pixel coordinates of the sensor's origin
  const float* normals = nullptr;          ///< width * height * 3
  /// width * height: Surface::confidence, or the contact where all of it is known equally well
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

/// r = Rᵀ n'(π(R q + t)) - n for every sample, π: CameraModel::project() (`rotation` row-major 3x3,
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

/// gradient = Σ w Jᵀ r (5), hessian = Σ w JᵀJ (15, upper triangle).
void accumulate_normal_equations(const Samples& samples, const Residuals& residuals, double* gradient,
                                 double* hessian);

}  // namespace gelslam::registration::detail
