#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <opencv2/core/types.hpp>

#include "gelslam/calibration/optics_fit.hpp"

namespace gelslam::calibration::detail {

/// The unknowns of a fit: those of OpticsFit, with 1/distance in place of the distance.
using OpticsNumbers = std::array<double, OpticsFit::kNumbers>;
OpticsNumbers numbers_of(const SensorOptics& optics);

/// What is known of any such sensor beforehand: so much may the numbers differ from usual ones.
inline constexpr OpticsNumbers kPriorSigma = {0.05, 6.0, 6.0, 0.03, 0.02, 0.0015, 0.0015};

/// A difference from the numbers before, in standard deviations of the prior.
struct OpticsPrior {
  OpticsNumbers start;
  template <class T>
  bool operator()(const T* numbers, T* error) const {
    for (std::size_t k = 0; k < start.size(); ++k) error[k] = (numbers[k] - start[k]) / kPriorSigma[k];
    return true;
  }
};

/// CameraModel for numbers that are derivatives, too.
template <class T>
struct OpticsModel {
  using Vector2 = Eigen::Matrix<T, 2, 1>;
  using Vector3 = Eigen::Matrix<T, 3, 1>;
  const T* numbers;
  cv::Size size;
  double pitch_mm;

  T inverse_distance() const { return numbers[4]; }
  double half_width() const { return 0.5 * size.width; }
  Vector2 principal_px() const {
    return {0.5 * size.width - 0.5 + numbers[1], 0.5 * size.height - 0.5 + numbers[2]};
  }
  Vector2 axis_scale() const {
    using std::sqrt;
    const T root = sqrt(numbers[3]);
    return {root, 1.0 / root};
  }

  Vector2 raw_px(const Vector2& rest_mm) const {
    const Vector2 r = axis_scale().cwiseProduct(rest_mm) / T(half_width() * pitch_mm);
    return principal_px() + T(half_width()) * (T(1.0) + numbers[0] * r.squaredNorm()) * r;
  }
  Vector2 rest_mm(const Vector2& raw_px) const {
    const Vector2 distorted = (raw_px - principal_px()) / T(half_width());
    const T bend = numbers[0] * distorted.squaredNorm();
    T scale(1.0);  // s + bend s³ = 1, by Newton's method
    for (int step = 0; step < 6; ++step)
      scale -= (scale + bend * scale * scale * scale - 1.0) / (1.0 + 3.0 * bend * scale * scale);
    return T(half_width() * pitch_mm) * scale * distorted.cwiseQuotient(axis_scale());
  }

  Vector2 project(const Vector3& point_mm) const {
    return point_mm.template head<2>() / (1.0 + point_mm.z() * inverse_distance());
  }
  Vector3 point_mm(const Vector2& rest_mm, const T& height_mm) const {
    const T scale = 1.0 + height_mm * inverse_distance();
    return {scale * rest_mm.x(), scale * rest_mm.y(), height_mm};
  }
  T rest_height_mm(const Vector2& xy_mm) const {
    return -(numbers[5] * xy_mm.x() * xy_mm.x() + numbers[6] * xy_mm.y() * xy_mm.y());
  }
  /// The point of the gel at rest on a ray.
  Vector3 rest_point_mm(const Vector2& rest_mm) const {
    using std::sqrt;
    const T q = -rest_height_mm(rest_mm), scale = 2.0 / (1.0 + sqrt(1.0 + 4.0 * q * inverse_distance()));
    return {scale * rest_mm.x(), scale * rest_mm.y(), -q * scale * scale};
  }
  Vector2 rest_slope(const Vector2& xy_mm) const {
    return {-2.0 * numbers[5] * xy_mm.x(), -2.0 * numbers[6] * xy_mm.y()};
  }
  /// w = D ln(1 + z/D) and its inverse, by power series in which D may be infinite.
  T relief_of(const T& height_mm) const {
    const T t = height_mm * inverse_distance();
    return height_mm * (1.0 - t * (0.5 - t * (1.0 / 3 - t * (0.25 - t * 0.2))));
  }
  T height_of(const T& relief_mm) const {
    const T t = relief_mm * inverse_distance();
    return relief_mm * (1.0 + t * (0.5 + t * (1.0 / 6 + t * (1.0 / 24 + t / 120.0))));
  }
};

}  // namespace gelslam::calibration::detail
