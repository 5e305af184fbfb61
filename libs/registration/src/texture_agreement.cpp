#include <algorithm>

#include "normal_flow_reference.hpp"
#include "registration_quality.hpp"

namespace gelslam::registration::detail {
namespace {

Eigen::Vector3f vector(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

using SampleJacobian = Eigen::Matrix<float, 3, kParameters>;  // of a normal
using SampleMatrix = Eigen::Matrix<float, kParameters, kParameters>;

/// Returns how a normal `n` moves with the five parameters, where the surface's normal changes by dx and dy
/// per mm along the reference's x and y.
SampleJacobian jacobian_of(const PictureMotion& motion, const Eigen::Vector3f& n, const Eigen::Vector3f& dx,
                           const Eigen::Vector3f& dy) {
  using Row = Eigen::Map<const Eigen::Matrix<float, 1, kParameters>>;
  SampleJacobian jacobian = dx * Row(motion.x.data()) + dy * Row(motion.y.data());
  for (int axis = 0; axis < 3; ++axis) jacobian.col(axis) += n.cross(Eigen::Vector3f::Unit(axis));
  return jacobian;
}

/// Returns the information matrix that a gel pattern with a gradient of 1 rad/mm would have.
/// `moments`: the weighted sum of the outer products of the samples (x, y, z, 1). A sample moves along x by
/// (z, -y, 1) with (ry, rz, tx), and along y by (-z, x, 1) with (rx, rz, ty).
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
  constexpr std::size_t kEnoughSamples = 1000;  // They suffice to distinguish texture from noise.
  const std::size_t step = residuals.weight.size() / kEnoughSamples + 1;
  const auto stride = static_cast<float>(step);
  for (std::size_t k = 0; k < residuals.weight.size(); k += step) {
    const float w = stride * residuals.weight[k];
    if (w <= 0) continue;
    const cv::Point at = lookup.pixel(lookup.warped_mm(k));
    if (at.x < 1 || at.y < 1 || at.x + 1 >= target.contact.cols || at.y + 1 >= target.contact.rows) continue;

    // Along the reference's x and y the point moves on the surface, so its z changes too.
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
