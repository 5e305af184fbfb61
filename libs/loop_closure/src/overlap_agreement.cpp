#include "overlap_agreement.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace gelslam::loop_closure::detail {
namespace {

struct Moments {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double x, double y) {
    n += 1;
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  double covariance() const { return ab / n - a / n * (b / n); }
  double variance_a() const { return std::max(0.0, aa / n - a / n * (a / n)); }
  double variance_b() const { return std::max(0.0, bb / n - b / n * (b / n)); }
};

}  // namespace

OverlapAgreement compare_overlap(const Surface& older, const Surface& newer, const Pose& older_T_newer) {
  constexpr int kStep = 2;
  const double pitch = newer.pixel_pitch_mm;
  const double newer_u0 = newer.contact.cols / 2.0 - 0.5, newer_v0 = newer.contact.rows / 2.0 - 0.5;
  const double older_u0 = older.contact.cols / 2.0 - 0.5, older_v0 = older.contact.rows / 2.0 - 0.5;
  Moments curvature, gap;
  for (int v = 0; v < newer.contact.rows; v += kStep)
    for (int u = 0; u < newer.contact.cols; u += kStep) {
      if (!newer.contact(v, u)) continue;
      const Eigen::Vector3d p =
          older_T_newer *
          Eigen::Vector3d((u - newer_u0) * pitch, (v - newer_v0) * pitch, newer.height_mm(v, u));
      const auto x = static_cast<int>(std::lround(p.x() / older.pixel_pitch_mm + older_u0));
      const auto y = static_cast<int>(std::lround(p.y() / older.pixel_pitch_mm + older_v0));
      if (x < 0 || y < 0 || x >= older.contact.cols || y >= older.contact.rows || !older.contact(y, x))
        continue;
      curvature.add(newer.curvature(v, u), older.curvature(y, x));
      gap.add(older.height_mm(y, x) - p.z(), 0);
    }
  OverlapAgreement agreement;
  agreement.shared_pixels = static_cast<int>(curvature.n);
  if (agreement.shared_pixels == 0) return agreement;
  agreement.height_rmse_mm = std::sqrt(gap.variance_a());
  const double norm = std::sqrt(curvature.variance_a() * curvature.variance_b());
  agreement.relief_correlation = norm > 1e-12 ? curvature.covariance() / norm : 0.0;
  return agreement;
}

}  // namespace gelslam::loop_closure::detail
