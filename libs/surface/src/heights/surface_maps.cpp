#include "heights/surface_maps.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

constexpr float max_curvature = 0.7F;  // 1/pixel

void clip_curvature_to_contact(const cv::Mat1b& contact, cv::Mat1f& curvature) {
  for (int v = 0; v < curvature.rows; ++v) {
    const unsigned char* inside = contact[v];
    float* value = curvature[v];
    for (int u = 0; u < curvature.cols; ++u) {
      value[u] = inside[u] != 0 ? std::clamp(value[u], -max_curvature, max_curvature) : 0.0F;
    }
  }
}

}  // namespace

cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  cv::Mat3f normals(gx.size());
  for (int v = 0; v < gx.rows; ++v) {
    const float* x = gx[v];
    const float* y = gy[v];
    float* out = normals[v]->val;
    for (int u = 0; u < gx.cols; ++u) {
      const float z = 1.0F / std::sqrt(1.0F + x[u] * x[u] + y[u] * y[u]);
      out[3 * u] = -x[u] * z;
      out[3 * u + 1] = -y[u] * z;
      out[3 * u + 2] = z;
    }
  }
  return normals;
}

cv::Mat1f curvature_in_contact(const PoissonSolver& solved, const cv::Mat1b& contact) {
  cv::Mat1f curvature;
  cv::GaussianBlur(solved.divergence(), curvature, cv::Size(5, 5), 0.0);
  clip_curvature_to_contact(contact, curvature);
  return curvature;
}

}  // namespace gelslam::surface::detail
