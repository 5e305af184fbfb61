#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "gelslam/core/se3.hpp"

namespace gelslam::backend::detail {

/// What an edge measures, as plain functions over a scalar type so that Ceres can differentiate them.
/// A motion is a unit quaternion (x y z w) and a translation in mm.
template <typename T>
struct Motion {
  Eigen::Quaternion<T> rotation;
  Eigen::Matrix<T, 3, 1> translation_mm;
};

template <typename T>
Motion<T> relative_motion(const Motion<T>& map_T_from, const Motion<T>& map_T_to) {
  const Eigen::Quaternion<T> from_R_map = map_T_from.rotation.conjugate();
  return {from_R_map * map_T_to.rotation, from_R_map * (map_T_to.translation_mm - map_T_from.translation_mm)};
}

/// How a sensor that reads slopes gain[0] times too steep along x and gain[1] times along y measures a true
/// motion (pose_graph.hpp). Rotation is split as tilt * twist, not by scaling the rotation vector: that would
/// jump where an object comes back turned by 180 degrees about z, which is an ordinary loop. `center_mm`: the
/// shared center as measured, in `to`.
template <typename T>
Motion<T> as_measured(const Motion<T>& motion, const Eigen::Vector3d& center_mm, const T* gain) {
  using std::atan2, std::cos, std::sin, std::sqrt;
  const T x = motion.rotation.x(), y = motion.rotation.y(), z = motion.rotation.z(), w = motion.rotation.w();
  const T cos_half = sqrt(w * w + z * z);  // of the tilt angle; zero only for a motion turned upside down
  const Eigen::Quaternion<T> twist(w / cos_half, T(0), T(0), z / cos_half);
  const T tilt_x = (x * w - y * z) / cos_half, tilt_y = (y * w + x * z) / cos_half;
  const T sin_half_squared = tilt_x * tilt_x + tilt_y * tilt_y;
  Eigen::Quaternion<T> tilt;
  if (sin_half_squared < T(1e-12)) {  // the square root has no derivative at 0; the series' error is < 1e-16
    const T read_x = gain[1] * tilt_x, read_y = gain[0] * tilt_y;
    tilt = Eigen::Quaternion<T>(T(1) - (read_x * read_x + read_y * read_y) / T(2), read_x, read_y, T(0));
  } else {
    const T sin_half = sqrt(sin_half_squared);
    const T angle_per_sin = atan2(sin_half, cos_half) / sin_half;
    const T read_x = gain[1] * angle_per_sin * tilt_x, read_y = gain[0] * angle_per_sin * tilt_y;
    const T read_half = sqrt(read_x * read_x + read_y * read_y);
    const T scale = sin(read_half) / read_half;
    tilt = Eigen::Quaternion<T>(cos(read_half), scale * read_x, scale * read_y, T(0));
  }
  const T depth_gain = (gain[0] + gain[1]) / T(2);
  const Eigen::Matrix<T, 3, 1> read_center = center_mm.cast<T>();
  const Eigen::Matrix<T, 3, 1> true_center(read_center.x(), read_center.y(), read_center.z() / depth_gain);
  Eigen::Matrix<T, 3, 1> center_in_from = motion.rotation * true_center + motion.translation_mm;
  center_in_from.z() *= depth_gain;
  const Eigen::Quaternion<T> rotation = tilt * twist;
  return {rotation, center_in_from - rotation * read_center};
}

/// (rx ry rz tx ty tz) between a measured and a predicted motion, in the measured `to` frame; equal to the
/// SE(3) logarithm to first order, and cheaper.
template <typename T>
Eigen::Matrix<T, 6, 1> motion_error(const Eigen::Quaterniond& measured_rotation,
                                    const Eigen::Vector3d& measured_translation_mm,
                                    const Motion<T>& predicted) {
  using std::atan2, std::sqrt;
  const Eigen::Quaternion<T> inverse = measured_rotation.conjugate().cast<T>();
  const Eigen::Quaternion<T> error = inverse * predicted.rotation;
  const T sign = error.w() < T(0) ? T(-1) : T(1);  // q and -q are the same rotation: take the short way round
  const T sin_half_squared = error.vec().squaredNorm();
  T scale = T(2);
  if (sin_half_squared > T(1e-16)) {
    const T sin_half = sqrt(sin_half_squared);
    scale = T(2) * atan2(sin_half, sign * error.w()) / sin_half;
  }
  Eigen::Matrix<T, 6, 1> result;
  result.template head<3>() = sign * scale * error.vec();
  result.template tail<3>() = inverse * (predicted.translation_mm - measured_translation_mm.cast<T>());
  return result;
}

}  // namespace gelslam::backend::detail
