#include "heights/height_integrator.hpp"

#include "gelslam/core/target_clones.hpp"

namespace gelslam::surface::detail {
namespace {

// The smallest value of 1 - g·X / D. This number is proportional to the cosine between the ray and the
// normal, so it is positive for a surface that the camera sees. Noisy slopes can make it negative.
constexpr float kMinFacing = 0.1F;

/// Computes the derivatives of w by the rest coordinates, grad w = g / (1 - g·X / D), in one row of pixels.
GELSLAM_CLONES void derivatives_of_row(const float* gx, const float* gy, const float* x_mm, float y_mm,
                                       float inverse_distance, int length, float* dx, float* dy) {
  for (int u = 0; u < length; ++u) {
    const float facing = 1.0F - (gx[u] * x_mm[u] + gy[u] * y_mm) * inverse_distance;
    const float stretch = 1.0F / (facing > kMinFacing ? facing : kMinFacing);
    dx[u] = gx[u] * stretch;
    dy[u] = gy[u] * stretch;
  }
}

GELSLAM_CLONES void add_row(const float* from, int length, float factor, float* to) {
  for (int u = 0; u < length; ++u) to[u] += factor * from[u];
}

/// Replaces w by z = D (exp(w / D) - 1). The power series in 1 / D also holds for an infinite D.
GELSLAM_CLONES void heights_of_row(float* w, float inverse_distance, int length) {
  for (int u = 0; u < length; ++u) {
    const float t = w[u] * inverse_distance;
    w[u] *= 1.0F + t * (1.0F / 2 + t * (1.0F / 6 + t * (1.0F / 24 + t * (1.0F / 120 + t * (1.0F / 720)))));
  }
}

/// Replaces z by w = D ln(1 + z / D) = 2 D artanh(t) with t = z / (2 D + z), by the power series of artanh.
GELSLAM_CLONES void reliefs_of_row(float* z, float inverse_distance, int length) {
  for (int u = 0; u < length; ++u) {
    const float q = 2.0F / (2.0F + z[u] * inverse_distance), t = 0.5F * z[u] * inverse_distance * q,
                s = t * t;
    z[u] *= q * (1.0F + s * (1.0F / 3 + s * (1.0F / 5 + s * (1.0F / 7))));
  }
}

}  // namespace

HeightIntegrator::HeightIntegrator(const CameraModel& camera)
    : pitch_mm_(static_cast<float>(camera.pitch_mm)),
      inverse_distance_(static_cast<float>(camera.optics.inverse_distance())),
      poisson_(camera.size),
      rest_gx_(camera.size),
      rest_gy_(camera.size),
      rest_w_(camera.size) {
  for (int u = 0; u < camera.size.width; ++u)
    x_mm_.push_back(static_cast<float>(camera.to_mm(cv::Point(u, 0)).x()));
  for (int v = 0; v < camera.size.height; ++v)
    y_mm_.push_back(static_cast<float>(camera.to_mm(cv::Point(0, v)).y()));
  for (int v = 0; v < camera.size.height; ++v)
    for (int u = 0; u < camera.size.width; ++u) {
      const Eigen::Vector3d point = camera.rest_point_mm(camera.to_mm(cv::Point(u, v)));
      const Eigen::Vector2f slope = camera.rest_slope(point.head<2>()).cast<float>();
      rest_gx_(v, u) = slope.x();
      rest_gy_(v, u) = slope.y();
      rest_w_(v, u) = static_cast<float>(point.z());
    }
  rest_dx_.create(camera.size);
  rest_dy_.create(camera.size);
  for (int v = 0; v < camera.size.height; ++v) {
    reliefs_of_row(rest_w_[v], inverse_distance_, rest_w_.cols);
    to_derivatives(rest_gx_, rest_gy_, v, rest_dx_, rest_dy_);
  }
}

void HeightIntegrator::to_derivatives(const cv::Mat1f& gx, const cv::Mat1f& gy, int row, cv::Mat1f& dx,
                                      cv::Mat1f& dy) const {
  derivatives_of_row(gx[row], gy[row], x_mm_.data(), y_mm_[static_cast<std::size_t>(row)], inverse_distance_,
                     gx.cols, dx[row], dy[row]);
}

cv::Mat1f HeightIntegrator::solve(cv::Mat1f& gx, cv::Mat1f& gy) {
  dx_.create(gx.size());
  dy_.create(gx.size());
  for (int v = 0; v < gx.rows; ++v) {
    add_row(rest_gx_[v], gx.cols, 1.0F, gx[v]);
    add_row(rest_gy_[v], gx.cols, 1.0F, gy[v]);
    to_derivatives(gx, gy, v, dx_, dy_);
    add_row(rest_dx_[v], gx.cols, -1.0F, dx_[v]);
    add_row(rest_dy_[v], gx.cols, -1.0F, dy_[v]);
  }
  return poisson_.solve(dx_, dy_);
}

void HeightIntegrator::to_height(cv::Mat1f& relief_mm) const {
  for (int v = 0; v < relief_mm.rows; ++v) {
    add_row(rest_w_[v], relief_mm.cols, 1.0F, relief_mm[v]);
    heights_of_row(relief_mm[v], inverse_distance_, relief_mm.cols);
  }
}

}  // namespace gelslam::surface::detail
