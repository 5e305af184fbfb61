#include "gelslam/registration/overlap_agreement.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace gelslam {
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

/// Visits every second pixel of `from` in contact that lands in the image of `onto`: visit(v, u, landed_mm,
/// y, x).
template <typename Visit>
void for_each_landing(const Surface& from, const Surface& onto, const Pose& onto_T_from, Visit&& visit) {
  constexpr int kStep = 2;
  const double from_u0 = from.contact.cols / 2.0 - 0.5, from_v0 = from.contact.rows / 2.0 - 0.5;
  const double onto_u0 = onto.contact.cols / 2.0 - 0.5, onto_v0 = onto.contact.rows / 2.0 - 0.5;
  for (int v = 0; v < from.contact.rows; v += kStep)
    for (int u = 0; u < from.contact.cols; u += kStep) {
      if (!from.contact(v, u)) continue;
      const Eigen::Vector3d p =
          onto_T_from * Eigen::Vector3d((u - from_u0) * from.pixel_pitch_mm,
                                        (v - from_v0) * from.pixel_pitch_mm, from.height_mm(v, u));
      const auto x = static_cast<int>(std::lround(p.x() / onto.pixel_pitch_mm + onto_u0));
      const auto y = static_cast<int>(std::lround(p.y() / onto.pixel_pitch_mm + onto_v0));
      if (x >= 0 && y >= 0 && x < onto.contact.cols && y < onto.contact.rows) visit(v, u, p, y, x);
    }
}

/// What lies in bare gel, of what landed on the other's image.
struct FreeSpaceViolation {
  int inside = 0, landed = 0;

  void add(const Surface& gel, const Eigen::Vector3d& point_mm, int y, int x) {
    constexpr double kToleranceMm = 0.15;  // heights' own errors, and the membrane rim's, stay below
    const bool bare = !gel.contact(y, x);
    inside += bare && point_mm.z() < gel.height_mm(y, x) - kToleranceMm;
    landed += 1;
  }
};

}  // namespace

OverlapAgreement compare_overlap(const Surface& older, const Surface& newer, const Pose& older_T_newer) {
  Moments curvature, gap;
  FreeSpaceViolation free_space_violation;
  for_each_landing(newer, older, older_T_newer, [&](int v, int u, const Eigen::Vector3d& p, int y, int x) {
    free_space_violation.add(older, p, y, x);
    if (!older.contact(y, x)) return;
    curvature.add(newer.curvature(v, u), older.curvature(y, x));
    gap.add(older.height_mm(y, x) - p.z(), 0);
  });
  for_each_landing(
      older, newer, older_T_newer.inverse(),
      [&](int, int, const Eigen::Vector3d& p, int y, int x) { free_space_violation.add(newer, p, y, x); });
  OverlapAgreement agreement;
  agreement.shared_pixels = static_cast<int>(curvature.n);
  if (agreement.shared_pixels == 0) return agreement;
  agreement.free_space_violation =
      static_cast<double>(free_space_violation.inside) / free_space_violation.landed;
  agreement.height_rmse_mm = std::sqrt(gap.variance_a());
  const double norm = std::sqrt(curvature.variance_a() * curvature.variance_b());
  agreement.texture_correlation = norm > 1e-12 ? curvature.covariance() / norm : 0.0;
  return agreement;
}

}  // namespace gelslam
