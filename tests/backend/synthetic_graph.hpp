#pragma once

#include <cmath>
#include <random>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

constexpr double kDegree = M_PI / 180.0;

/// Noise that is independent of the code under test: a sum of uniform numbers, which is the same on all
/// machines.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : random_(seed) {}

  double normal() {
    double sum = 0;
    for (int k = 0; k < 12; ++k) sum += static_cast<double>(random_() >> 11) * 0x1p-53;
    return sum - 6.0;
  }

  Vector6d tangent(double sigma_rad, double sigma_mm) {
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = normal() * (i < 3 ? sigma_rad : sigma_mm);
    return xi;
  }

 private:
  std::mt19937_64 random_;
};

inline Matrix6d information_of(double sigma_rad, double sigma_mm) {
  Vector6d sigma;
  sigma << sigma_rad, sigma_rad, sigma_rad, sigma_mm, sigma_mm, sigma_mm;
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

/// Returns the true poses of a sensor on an object like a cylinder with the radius 10 mm, which rolls about y
/// by `step_deg` per keyframe. A little twist and climb are added, so that there is motion along all
/// directions.
inline Pose rolled(int keyframe, double step_deg) {
  Pose pose = Pose::Identity();
  const double angle = keyframe * step_deg * kDegree;
  pose.linear() = so3_exp({0, angle, 0}) * so3_exp({0, 0, 0.02 * keyframe});
  pose.translation() = Eigen::Vector3d(10 * std::sin(angle), 0.1 * keyframe, 10 * std::cos(angle) - 10);
  return pose;
}

inline constexpr double kSigmaRad = 0.002, kSigmaMm = 0.02;

struct Graph {
  std::map<int, Pose> truth;
  std::vector<PoseGraphEdge> edges;
  Noise noise{1};

  void join(int from, int to, EdgeKind kind, const Vector6d& noise = Vector6d::Zero(),
            double sigma_rad = kSigmaRad, double sigma_mm = kSigmaMm) {
    edges.push_back({from, to, truth.at(from).inverse() * truth.at(to) * se3_exp(noise),
                     information_of(sigma_rad, sigma_mm), kind});
  }

  /// Joins two nodes by an edge with random noise as large as its information says, and with the additional
  /// error `off`.
  void join_noisily(int from, int to, EdgeKind kind, const Vector6d& off = Vector6d::Zero()) {
    join(from, to, kind, off + noise.tangent(kSigmaRad, kSigmaMm));
  }
  /// Returns the poses that the tracker would have: the composed odometry from the first node on.
  std::map<int, Pose> chained() const {
    std::map<int, Pose> poses;
    if (!truth.empty()) poses.insert(*truth.begin());
    for (const PoseGraphEdge& edge : edges)
      if (edge.kind == EdgeKind::odometry) {
        poses.try_emplace(edge.from, Pose::Identity());  // a new trial starts in its own frame
        poses[edge.to] = poses.at(edge.from) * edge.from_T_to;
      }
    return poses;
  }
};

/// Returns a graph of `count` successive trials with `each` keyframes on one object, with noise if a seed is
/// given.
inline Graph trials(int count, int each, double step_deg, std::uint64_t seed = 0) {
  Graph graph;
  graph.noise = Noise(seed);
  for (int i = 0; i < each * count; ++i) graph.truth[i] = rolled(i, step_deg);
  for (int i = 0; i + 1 < each * count; ++i) {
    if (i % each == each - 1) continue;
    seed == 0 ? graph.join(i, i + 1, EdgeKind::odometry) : graph.join_noisily(i, i + 1, EdgeKind::odometry);
  }
  return graph;
}

inline Vector6d away(double rx, double ry, double rz, double x, double y, double z) {
  return (Vector6d() << rx, ry, rz, x, y, z).finished();
}

/// The largest errors over all nodes, in degrees and millimeters.
struct WorstError {
  double deg = 0, mm = 0;
};

inline WorstError worst_error(const std::map<int, Pose>& poses, const std::map<int, Pose>& truth) {
  WorstError worst;
  for (const auto& [id, pose] : truth) {
    const Pose error = pose.inverse() * poses.at(id);
    worst.deg = std::max(worst.deg, rotation_angle_rad(error) / kDegree);
    worst.mm = std::max(worst.mm, error.translation().norm());
  }
  return worst;
}

/// The read slopes divided by the true slopes.
struct ReadOverTrue {
  double x = 1.0, y = 1.0;
  double y_in_x = 0.0, x_in_y = 0.0;  // of the true slope along y (x), in the one read along x (y)
  double mean() const { return 0.5 * (x + y); }
};

// Returns the motion that a sensor with a gradient scale measures instead of the true one. It is written
// independently of the library: axis and angle of the tilt after a twist about z follow from the image of the
// z axis. Slopes along x show the tilt about y, and those along y the tilt about x.
inline Pose with_scale(const Pose& motion, const ReadOverTrue& scale) {
  const Eigen::Vector3d z = motion.linear().col(2);
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(z);
  const double angle = std::atan2(axis.norm(), z.z());
  Pose measured = motion;
  if (axis.norm() > 0) {
    const Eigen::AngleAxisd tilt(angle, axis.normalized());
    const Eigen::Vector3d about = angle * axis.normalized();
    const Eigen::Matrix3d read = so3_exp(
        {scale.y * about.x() - scale.x_in_y * about.y(), scale.x * about.y() - scale.y_in_x * about.x(), 0});
    measured.linear() = read * tilt.toRotationMatrix().transpose() * motion.linear();
  }
  measured.translation().z() *= scale.mean();
  return measured;
}

inline Graph roll_of_400_degrees(const ReadOverTrue& scale, bool with_loop) {
  Graph graph = trials(1, 101, 4);
  if (with_loop) graph.join(0, 90, EdgeKind::loop);
  for (PoseGraphEdge& edge : graph.edges) edge.from_T_to = with_scale(edge.from_T_to, scale);
  return graph;
}

}  // namespace gelslam
