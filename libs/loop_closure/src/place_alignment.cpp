#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <random>

#include "place_features.hpp"

namespace gelslam::loop_closure::detail {
namespace {

struct Rigid2 {
  Eigen::Matrix2f rotation;
  Eigen::Vector2f shift;

  Eigen::Vector2f operator*(const Eigen::Vector2f& p) const { return rotation * p + shift; }
};

struct PointPair {
  Eigen::Vector2f older, newer;
};

// Fits a rigid motion by least squares (Umeyama 1991 in two dimensions, without scale).
Rigid2 fit(const std::vector<PointPair>& pairs) {
  Eigen::Vector2f older = Eigen::Vector2f::Zero(), newer = Eigen::Vector2f::Zero();
  for (const PointPair& p : pairs) older += p.older, newer += p.newer;
  older /= static_cast<float>(pairs.size());
  newer /= static_cast<float>(pairs.size());
  float cosine = 0, sine = 0;
  for (const PointPair& p : pairs) {
    const Eigen::Vector2f a = p.newer - newer, b = p.older - older;
    cosine += a.dot(b);
    sine += a.x() * b.y() - a.y() * b.x();
  }
  Rigid2 result;
  result.rotation = Eigen::Rotation2Df(std::atan2(sine, cosine)).toRotationMatrix();
  result.shift = older - result.rotation * newer;
  return result;
}

std::vector<std::size_t> inliers(const std::vector<PointPair>& pairs, const Rigid2& older_T_newer,
                                 double threshold_px) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if ((older_T_newer * pairs[i].newer - pairs[i].older).norm() < threshold_px) result.push_back(i);
  return result;
}

std::vector<PointPair> pick(const std::vector<PointPair>& pairs, const std::vector<std::size_t>& chosen) {
  std::vector<PointPair> result;
  for (const std::size_t i : chosen) result.push_back(pairs[i]);
  return result;
}

// Two matches may belong to one place when they are as far apart in both frames.
bool may_be_one_place(const PointPair& a, const PointPair& b, double threshold_px) {
  const float older = (a.older - b.older).norm(), newer = (a.newer - b.newer).norm();
  // Two points closer than three times the threshold do not fix a rotation.
  return std::min(older, newer) > 3 * threshold_px && std::abs(older - newer) < 2 * threshold_px;
}

Eigen::Vector3d point_mm(const Surface& surface, const Eigen::Vector2f& pixel) {
  const int u = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, surface.height_mm.cols - 1);
  const int v = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, surface.height_mm.rows - 1);
  const CameraModel camera = surface.camera();
  return camera.point_mm(camera.to_mm(Eigen::Vector2d(pixel.cast<double>())),
                         static_cast<double>(surface.height_mm(v, u)));
}

// Returns the mean normal over 7x7 pixels, because a matched point is where texture is steep, and one pixel
// off there reads another normal.
Eigen::Vector3d normal_around(const Surface& surface, const Eigen::Vector2f& pixel) {
  constexpr int kRadius = 3;
  const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
  Eigen::Vector3d sum(0, 0, 1e-9);
  for (int y = std::max(0, v - kRadius); y <= std::min(surface.normals.rows - 1, v + kRadius); ++y)
    for (int x = std::max(0, u - kRadius); x <= std::min(surface.normals.cols - 1, u + kRadius); ++x) {
      const cv::Vec3f& n = surface.normals(y, x);
      sum += Eigen::Vector3d(n[0], n[1], n[2]);
    }
  return sum.normalized();
}

}  // namespace

std::vector<Match> rigid_inliers(const PlaceFeatures& older, const PlaceFeatures& newer,
                                 const std::vector<Match>& matches, double threshold_px, int iterations) {
  std::vector<PointPair> pairs;
  for (const Match& m : matches)
    pairs.push_back(
        {older.pixels[static_cast<std::size_t>(m.a)], newer.pixels[static_cast<std::size_t>(m.b)]});
  if (pairs.size() < 2) return {};

  std::mt19937_64 random;  // with its standard seed: the same input gives the same answer
  std::vector<std::size_t> best;
  // Drawing a pair that cannot be right costs next to nothing, so only those that may be count as iterations.
  constexpr int kDrawsPerIteration = 20;
  for (int draw = 0, tried = 0; draw < kDrawsPerIteration * iterations && tried < iterations; ++draw) {
    const PointPair &a = pairs[random() % pairs.size()], &b = pairs[random() % pairs.size()];
    if (!may_be_one_place(a, b, threshold_px)) continue;
    ++tried;
    std::vector<std::size_t> found = inliers(pairs, fit({a, b}), threshold_px);
    if (found.size() > best.size()) best = std::move(found);
  }
  while (best.size() >= 2) {
    std::vector<std::size_t> found = inliers(pairs, fit(pick(pairs, best)), threshold_px);
    if (found.size() <= best.size()) break;
    best = std::move(found);
  }
  std::vector<Match> result;
  for (const std::size_t i : best) result.push_back(matches[i]);
  return result;
}

std::optional<Pose> lift(const Surface& older, const Surface& newer, const PlaceFeatures& older_features,
                         const PlaceFeatures& newer_features, const std::vector<Match>& matches) {
  if (matches.size() < 3) return std::nullopt;
  std::vector<Eigen::Vector3d> a, b;
  Eigen::Vector3d center_a = Eigen::Vector3d::Zero(), center_b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (const Match& m : matches) {
    const Eigen::Vector2f pixel_a = older_features.pixels[static_cast<std::size_t>(m.a)];
    const Eigen::Vector2f pixel_b = newer_features.pixels[static_cast<std::size_t>(m.b)];
    a.push_back(point_mm(older, pixel_a));
    b.push_back(point_mm(newer, pixel_b));
    center_a += a.back() / static_cast<double>(matches.size());
    center_b += b.back() / static_cast<double>(matches.size());
    correlation += normal_around(older, pixel_a) * normal_around(newer, pixel_b).transpose();
  }
  double spread = 1e-12;
  Eigen::Matrix3d point_correlation = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    point_correlation += (a[i] - center_a) * (b[i] - center_b).transpose();
    spread += (a[i] - center_a).squaredNorm();
  }
  // The rotation is that of Kabsch (1976) for points and normals: points over their spread weigh as much as
  // unit normals do.
  correlation += point_correlation * (static_cast<double>(a.size()) / spread);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
  Pose older_T_newer = Pose::Identity();
  older_T_newer.linear() =
      svd.matrixU() * Eigen::Vector3d(1, 1, handedness).asDiagonal() * svd.matrixV().transpose();
  older_T_newer.translation() = center_a - older_T_newer.linear() * center_b;
  return older_T_newer;
}

}  // namespace gelslam::loop_closure::detail
