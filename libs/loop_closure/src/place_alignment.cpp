// RANSAC for the rotation and shift in the image between two keyframes, and its lift to a pose in 3-D.
//
// Two matches determine a rigid motion in the plane. Only pairs of matches with equal distances in both
// images are tried, as a motion without scale requires. The motion with most matches within the threshold is
// fitted again to all of them by least squares as long as this gains inliers. lift() adds tilt and z from
// normals and points, which the image does not determine.

#include <algorithm>
#include <cmath>
#include <random>

#include "gelslam/registration/relocalization.hpp"
#include "place_features.hpp"

namespace gelslam::loop_closure::detail {
namespace {

struct PointPair {
  Eigen::Vector2f older, newer;
};

// Fits a rotation and a shift to pairs of points by least squares (Umeyama 1991 in two dimensions, without
// scale).
RigidMotion fit(const std::vector<PointPair>& pairs) {
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
  RigidMotion result;
  result.rotation = Eigen::Rotation2Df(std::atan2(sine, cosine)).toRotationMatrix();
  result.shift = older - result.rotation * newer;
  return result;
}

std::vector<std::size_t> inliers(const std::vector<PointPair>& pairs, const RigidMotion& older_T_newer,
                                 double threshold_px) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if ((older_T_newer * pairs[i].newer - pairs[i].older).norm() < threshold_px) result.push_back(i);
  return result;
}

std::vector<PointPair> pick(const std::vector<PointPair>& pairs, const std::vector<std::size_t>& chosen) {
  std::vector<PointPair> result;
  result.reserve(chosen.size());
  for (const std::size_t i : chosen) result.push_back(pairs[i]);
  return result;
}

// Two correct matches are the same distance apart in both images, so a pair that is not need not be tried.
bool may_be_one_place(const PointPair& a, const PointPair& b, double threshold_px) {
  const float older = (a.older - b.older).norm(), newer = (a.newer - b.newer).norm();
  // Two points closer than three times the threshold do not determine a rotation.
  return std::min(older, newer) > 3 * threshold_px && std::abs(older - newer) < 2 * threshold_px;
}

}  // namespace

RigidMotion align_rigidly(const PlaceFeatures& older, const PlaceFeatures& newer,
                          const std::vector<Match>& matches, double threshold_px, int iterations) {
  std::vector<PointPair> pairs;
  pairs.reserve(matches.size());
  for (const Match& m : matches)
    pairs.push_back(
        {older.pixels[static_cast<std::size_t>(m.a)], newer.pixels[static_cast<std::size_t>(m.b)]});
  if (pairs.size() < 2) return {};

  std::mt19937_64 random;  // The default seed gives the same answer for the same input.
  std::vector<std::size_t> best;
  // Rejecting a pair by its distances is cheap, so only pairs that pass count as iterations.
  constexpr int kDrawsPerIteration = 20;
  for (int draw = 0, tried = 0; draw < kDrawsPerIteration * iterations && tried < iterations; ++draw) {
    const PointPair &a = pairs[random() % pairs.size()], &b = pairs[random() % pairs.size()];
    if (!may_be_one_place(a, b, threshold_px)) continue;
    ++tried;
    std::vector<std::size_t> found = inliers(pairs, fit({a, b}), threshold_px);
    if (found.size() > best.size()) best = std::move(found);
  }
  RigidMotion motion;
  while (best.size() >= 2) {
    motion = fit(pick(pairs, best));
    std::vector<std::size_t> found = inliers(pairs, motion, threshold_px);
    if (found.size() <= best.size()) break;
    best = std::move(found);
  }
  motion.inliers = static_cast<int>(best.size());
  return motion;
}

Pose lift(const Surface& older, const Surface& newer, const RigidMotion& older_T_newer) {
  const Eigen::Vector2f center = newer.camera().center_px().cast<float>();
  return coarse_pose(newer, older, std::atan2(older_T_newer.rotation(1, 0), older_T_newer.rotation(0, 0)),
                     older.camera().to_mm(Eigen::Vector2d((older_T_newer * center).cast<double>())));
}

}  // namespace gelslam::loop_closure::detail
