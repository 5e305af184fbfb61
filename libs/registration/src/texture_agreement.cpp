// Compares the gradients of the normals of two registered surfaces, to find out along which motions they
// share texture and along which there is only noise. This is not in the papers.
//
// Let J_k be the Jacobian (3x5) of the normal at sample k by the five parameters of the motion, from the
// gradients of the reference's normals, and J'_k the same from those of the target's normals.
// compare_texture() returns H = sum w JᵀJ, to which texture and noise contribute; C = the symmetric part of
// sum w JᵀJ', to which only texture contributes, because the noise of two frames is independent; and G, the
// contribution to H of a gel pattern that changes the normals by a given angle per mm (docs/algorithms.md,
// "What both surfaces show").

#include <algorithm>

#include "normal_flow_reference.hpp"
#include "registration_quality.hpp"

namespace gelslam::registration::detail {
namespace {

Eigen::Vector3f vector(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

using SampleJacobian = Eigen::Matrix<float, 3, kParameters>;  // by which a normal changes
using SampleMatrix = Eigen::Matrix<float, kParameters, kParameters>;

/// Returns the derivatives of the normal `n` by the five parameters. `dx`, `dy`: the change of the normal per
/// mm along x and y of the reference; `motion`: the motion of the sample in the reference's picture.
SampleJacobian jacobian_of(const PictureMotion& motion, const Eigen::Vector3f& n, const Eigen::Vector3f& dx,
                           const Eigen::Vector3f& dy) {
  using Row = Eigen::Map<const Eigen::Matrix<float, 1, kParameters>>;
  SampleJacobian jacobian = dx * Row(motion.x.data()) + dy * Row(motion.y.data());
  for (int axis = 0; axis < 3; ++axis) jacobian.col(axis) += n.cross(Eigen::Vector3f::Unit(axis));
  return jacobian;
}

/// Returns the contribution of a gel pattern to the information matrix, for a pattern that changes the
/// normals by 1 rad/mm along x and y. `moments`: the weighted sum of the outer products of the vectors (x, y,
/// z, 1) of the samples. The derivatives of a sample's x by (ry, rz, tx) are (z, -y, 1), and those of its y
/// by (rx, rz, ty) are (-z, x, 1).
Matrix5d gel_pattern(const Eigen::Matrix4d& moments) {
  Eigen::Matrix<double, kParameters, 4> along_x = Eigen::Matrix<double, kParameters, 4>::Zero(),
                                        along_y = along_x;
  along_x(1, 2) = along_x(3, 3) = along_y(2, 0) = along_y(4, 3) = 1;
  along_x(2, 1) = along_y(0, 2) = -1;
  return along_x * moments * along_x.transpose() + along_y * moments * along_y.transpose();
}

}  // namespace

TextureAgreement compare_texture(const Samples& s, const Surface& target, const Pose& target_T_reference,
                                 const Residuals& residuals, double gel_pattern_per_mm) {
  const PixelLookup lookup(s, target, target_T_reference);
  const Viewpoint view = viewpoint_of(view_of(target), target_T_reference, s, residuals);
  const Eigen::Matrix3f& rotation = lookup.rotation();
  const Eigen::Matrix3f back = rotation.transpose();
  SampleMatrix read = SampleMatrix::Zero(), common = read;
  Eigen::Matrix4f moments = Eigen::Matrix4f::Zero();
  constexpr std::size_t kEnoughSamples = 1000;  // so many suffice to distinguish texture from noise
  const std::size_t step = residuals.weight.size() / kEnoughSamples + 1;
  const auto stride = static_cast<float>(step);
  for (std::size_t k = 0; k < residuals.weight.size(); k += step) {
    const float w = stride * residuals.weight[k];
    if (w <= 0) continue;
    const cv::Point at = lookup.pixel(lookup.warped_mm(k));
    if (at.x < 1 || at.y < 1 || at.x + 1 >= target.contact.cols || at.y + 1 >= target.contact.rows) continue;

    // The change of the target's normal per mm along x and y of the reference, turned back to the axes of the
    // reference. The point stays on the surface, so its z changes by the slope.
    const float facing = std::max(s.nz[k], kMinFacing);
    const float slope_x = -s.nx[k] / facing, slope_y = -s.ny[k] / facing;
    const NormalGradient gradient = normal_gradient(target.normals, at);
    const Eigen::Vector3f along_u = vector(gradient.dx), along_v = vector(gradient.dy);
    const auto carried_back = [&](float du, float dv) {
      return Eigen::Vector3f(back * ((du * along_u + dv * along_v) * lookup.inverse_pitch_per_mm()));
    };
    const Eigen::Vector3f dx =
        carried_back(rotation(0, 0) + rotation(0, 2) * slope_x, rotation(1, 0) + rotation(1, 2) * slope_x);
    const Eigen::Vector3f dy =
        carried_back(rotation(0, 1) + rotation(0, 2) * slope_y, rotation(1, 1) + rotation(1, 2) * slope_y);
    const Eigen::Vector3f n(s.nx[k] + residuals.rx[k], s.ny[k] + residuals.ry[k], s.nz[k] + residuals.rz[k]);
    const PictureMotion motion = picture_motion(s, k, view);
    const Eigen::Vector3f normal(s.nx[k], s.ny[k], s.nz[k]);
    const auto& g = s.gradient;
    const SampleJacobian here = jacobian_of(motion, normal, {g[0][k], g[1][k], g[2][k]},
                                            {g[3][k], g[4][k], g[5][k]}),
                         there = jacobian_of(motion, n, dx, dy);
    const SampleJacobian weighted = w * here;
    read += weighted.transpose() * here;
    common += weighted.transpose() * there;
    const Eigen::Vector4f place(s.x[k], s.y[k], s.z[k], 1);
    moments += w * place * place.transpose();
  }
  TextureAgreement texture;
  texture.read = read.cast<double>();
  texture.common = 0.5 * (common + common.transpose()).cast<double>();
  texture.pattern = gel_pattern_per_mm * gel_pattern_per_mm * gel_pattern(moments.cast<double>());
  return texture;
}

}  // namespace gelslam::registration::detail
