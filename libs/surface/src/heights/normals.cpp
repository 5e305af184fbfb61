// Computes normals and curvature from the gradient g of the height (Huang et al., NormalFlow, RA-L 2024): n =
// (-gx, -gy, 1) / sqrt(1 + gx² + gy²), and the curvature d(gx)/dx + d(gy)/dy. In the contact, the curvature
// is averaged with a Gaussian over 5x5 pixels, without those whose color was interpolated.

#include "heights/normals.hpp"

#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/surface.hpp"
#include "heights/contact_mask.hpp"
#include "lanes.hpp"

namespace gelslam::surface::detail {
namespace {

GELSLAM_CLONES void normals_of_row(const float* gx, const float* gy, std::size_t length, float* out) {
  std::size_t u = 0;
  for (; u + kLanes <= length; u += kLanes) {
    Lanes x, y;
    std::memcpy(&x, gx + u, sizeof x);
    std::memcpy(&y, gy + u, sizeof y);
    Lanes z = 1.0F + x * x + y * y;
    for (int lane = 0; lane < kLanes; ++lane) z[lane] = std::sqrt(z[lane]);
    z = 1.0F / z;
    x *= -z;
    y *= -z;
    const Lanes low = __builtin_shufflevector(x, y, 0, 8, 1, 9, 2, 10, 3, 11),
                high = __builtin_shufflevector(x, y, 4, 12, 5, 13, 6, 14, 7, 15),
                middle = __builtin_shufflevector(low, high, 5, 6, 7, 0, 8, 9, 10, 11);
    const Lanes first = __builtin_shufflevector(low, z, 0, 1, 8, 2, 3, 9, 4, 5),
                second = __builtin_shufflevector(middle, z, 10, 1, 2, 11, 4, 5, 12, 6),
                third = __builtin_shufflevector(high, z, 3, 13, 4, 5, 14, 6, 7, 15);
    std::memcpy(out + 3 * u, &first, sizeof first);
    std::memcpy(out + 3 * u + kLanes, &second, sizeof second);
    std::memcpy(out + 3 * u + 2 * kLanes, &third, sizeof third);
  }
  for (; u < length; ++u) {
    const float z = 1.0F / std::sqrt(1.0F + gx[u] * gx[u] + gy[u] * gy[u]);
    out[3 * u] = -gx[u] * z;
    out[3 * u + 1] = -gy[u] * z;
    out[3 * u + 2] = z;
  }
}

}  // namespace

cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  cv::Mat3f normals(gx.size());
  for (int v = 0; v < gx.rows; ++v)
    normals_of_row(gx[v], gy[v], static_cast<std::size_t>(gx.cols), normals[v]->val);
  return normals;
}

cv::Mat1f divergence(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  cv::Mat1f by_x, by_y;
  cv::Sobel(gx, by_x, CV_32F, 1, 0, 1, 0.5, 0.0, cv::BORDER_REPLICATE);
  cv::Sobel(gy, by_y, CV_32F, 0, 1, 1, 0.5, 0.0, cv::BORDER_REPLICATE);
  by_x += by_y;
  return by_x;
}

cv::Mat1f curvature_in_contact(const cv::Mat1f& bend, const cv::Mat1b& contact, double pixel_pitch_mm,
                               const cv::Mat1b& unread) {
  constexpr int kSmoothedPx = 2;  // to each side; the noise of neighboring pixels is independent
  cv::Mat1f curvature(contact.size(), 0.0F), smooth;
  const cv::Rect box = cv::boundingRect(contact);
  if (box.empty()) return curvature;
  const cv::Rect around = grown(box, kSmoothedPx, contact.size());
  const cv::Size kernel(2 * kSmoothedPx + 1, 2 * kSmoothedPx + 1);
  cv::Mat1f sharp = bend(around).clone();
  if (!unread.empty()) sharp.setTo(0.0, unread(around));
  cv::GaussianBlur(sharp, smooth, kernel, 0.0);
  if (!unread.empty()) {
    cv::Mat1f read;
    cv::Mat(unread(around) == 0).convertTo(read, CV_32F, 1.0 / 255);
    cv::GaussianBlur(read, read, kernel, 0.0);
    cv::divide(smooth, read, smooth);
    smooth.setTo(0.0, unread(around));
  }
  const double limit = kMaxCurvaturePerMm * pixel_pitch_mm;
  cv::min(smooth, limit, smooth);
  cv::max(smooth, -limit, smooth);
  smooth(box - around.tl()).copyTo(curvature(box), contact(box));
  return curvature;
}

}  // namespace gelslam::surface::detail
