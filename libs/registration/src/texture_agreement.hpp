#pragma once

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_kernels.hpp"

namespace gelslam::registration::detail {

using Vector5d = Eigen::Matrix<double, kParameters, 1>;
using Matrix5d = Eigen::Matrix<double, kParameters, kParameters>;

/// Motions (rx ry rz tx ty) as columns, at most five.
using Directions = Eigen::Matrix<double, kParameters, Eigen::Dynamic, 0, kParameters, kParameters>;

/// What the gradients of the normals say about the five motions, over the shared contact. A read gradient is
/// the object's and noise; the object's is found again in the target, noise is not.
struct TextureAgreement {
  Matrix5d read = Matrix5d::Zero();  ///< Σ w JᵀJ: the object and noise
  /// Σ w JᵀJ', J' from the target's gradients, symmetric: the object alone
  Matrix5d common = Matrix5d::Zero();
  Matrix5d pattern = Matrix5d::Zero();  ///< what moves with the gel (the model's unevenness) adds to both
};

TextureAgreement compare_texture(const Samples& samples, const Surface& target,
                                 const Pose& target_T_reference, const Residuals& residuals,
                                 double gel_pattern_per_mm);

/// The directions that both surfaces show. A motion's part along one of them is measures.col(i) * motion.
struct ShownDirections {
  Directions measures;
  Directions followed;        ///< these and weaker ones: worth moving along, though not to be relied on
  std::vector<double> share;  ///< of what was read along each, that is common to both: 0..1
  std::vector<double> pattern_share;  ///< of what is common, that may move with the gel: 0..1
  int count() const { return static_cast<int>(share.size()); }
};

/// A direction is shown when at least `least_share` of what was read along it is common to both.
ShownDirections shown_directions(const TextureAgreement& texture, double least_share);

}  // namespace gelslam::registration::detail
