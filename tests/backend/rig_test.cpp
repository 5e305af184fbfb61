#include "gelslam/backend/rig.hpp"

#include <gtest/gtest.h>

#include "gelslam/backend/pose_covariance.hpp"
#include "gelslam/backend/uncertain_motion.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

constexpr int kKeyframes = 12;
constexpr double kSigmaRad = 0.002, kSigmaMm = 0.02;

Pose pose(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& mm) {
  Pose pose = Pose::Identity();
  pose.linear() = so3_exp(turn_rad);
  pose.translation() = mm;
  return pose;
}

/// Two sensors that face each other, and feel an object as it is turned about all axes.
struct TwoSensors {
  explicit TwoSensors(double noise = 0, std::uint64_t seed = 1) : random(seed) {
    for (int k = 0; k < kKeyframes; ++k) {
      graph.truth[k] = pose({0.3 * std::sin(0.5 * k), 0.25 * std::sin(0.8 * k), 0.2 * std::cos(0.6 * k)},
                            {2 * std::cos(0.4 * k), 1.5 * std::sin(0.7 * k), 0.2 * std::sin(k)});
      graph.truth[kKeyframes + k] = graph.truth[k] * first_T_second;
    }
    for (const int first : {0, kKeyframes})
      for (int k = 1; k < kKeyframes; ++k)
        graph.join(first + k - 1, first + k, EdgeKind::odometry,
                   random.tangent(noise * kSigmaRad, noise * kSigmaMm));
    const Matrix6d covariance = information_of(kSigmaRad, kSigmaMm).inverse();
    for (int k = 0; k < kKeyframes; ++k) {
      // At an instant after both keyframes.
      const Pose since = pose({0.02, -0.01, 0.03}, {0.3, 0.2, -0.1});
      const Pose second_since = first_T_second.inverse() * since * first_T_second;
      constraints.push_back(
          {k, kKeyframes + k, since * error(noise), second_since * error(noise), covariance, covariance});
    }
  }

  Pose error(double noise) { return se3_exp(random.tangent(noise * kSigmaRad, noise * kSigmaMm)); }

  PoseGraphSolution apart() const {
    Graph started = graph;
    return solve_pose_graph(started.chained(), graph.edges, {});
  }

  Noise random;
  Graph graph;
  std::vector<RigConstraint> constraints;
  const Pose first_T_second = pose({3.0, 0.1, -0.2}, {1.5, -0.8, 13});
};

// The first sensor's start is the smallest node, and every piece starts at the identity.
TEST(Rig, IsFoundFromTheMotionsOfBothSensors) {
  const TwoSensors sensors;
  const std::optional<Pose> found = rig_from_motions(sensors.constraints, sensors.apart());
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->isApprox(sensors.first_T_second, 1e-6));
}

TEST(Rig, IsSolvedWithThePosesAndPutsBothMapsTogether) {
  const TwoSensors sensors;
  const Pose start = sensors.first_T_second * pose({0.05, -0.04, 0.03}, {0.5, 0.4, -0.6});
  const RigSolution rig = solve_with_rig(sensors.apart(), sensors.graph.edges, sensors.constraints, start,
                                         {.first_of_second = kKeyframes}, {});
  EXPECT_TRUE(rig.first_T_second.isApprox(sensors.first_T_second, 1e-5));
  for (int k = 0; k < kKeyframes; ++k) {
    EXPECT_EQ(rig.graph.component_of_node.at(kKeyframes + k), 0);
    const Pose between =
        rig.graph.component_T_node.at(k).inverse() * rig.graph.component_T_node.at(kKeyframes + k);
    EXPECT_TRUE(between.isApprox(sensors.first_T_second, 1e-5)) << k;
  }
}

// Over many noisy scans, squared errors in standard deviations have the mean of a chi-square distribution.
TEST(Rig, ErrorsAreAsLargeAsItsCovarianceSays) {
  constexpr int kScans = 200;
  double sum = 0;
  for (int scan = 0; scan < kScans; ++scan) {
    const TwoSensors sensors(1.0, 100 + static_cast<std::uint64_t>(scan));
    const RigPrior prior{.first_of_second = kKeyframes};
    const RigSolution rig = solve_with_rig(sensors.apart(), sensors.graph.edges, sensors.constraints,
                                           sensors.first_T_second, prior, {});
    std::vector<PoseGraphEdge> all = sensors.graph.edges;
    all.insert(all.end(), rig.edges.begin(), rig.edges.end());
    const Matrix6d covariance =
        graph_covariances(all, rig.graph, 0, {},
                          rig_unknowns(sensors.graph.edges, sensors.constraints, rig.first_T_second, prior))
            .shared_unknowns;
    const Vector6d error = se3_log(rig.first_T_second.inverse() * sensors.first_T_second);
    sum += error.dot(covariance.inverse() * error);
  }
  // Its standard deviation is sqrt(2 * 6 / 200) = 0.24.
  EXPECT_NEAR(sum / kScans, 6.0, 0.8);
}

TEST(Rig, StaysWhatIsKnownWhereNothingMoves) {
  TwoSensors sensors;
  sensors.constraints.resize(1);
  const RigPose known{sensors.first_T_second, information_of(0.03, 1.0).inverse()};
  const RigPrior prior{&known, kKeyframes};
  const RigSolution rig = solve_with_rig(sensors.apart(), sensors.graph.edges, sensors.constraints,
                                         known.first_T_second, prior, {});
  EXPECT_TRUE(rig.first_T_second.isApprox(known.first_T_second, 1e-6));
  std::vector<PoseGraphEdge> all = sensors.graph.edges;
  all.insert(all.end(), rig.edges.begin(), rig.edges.end());
  const GraphCovariances covariances =
      graph_covariances(all, rig.graph, 0, {},
                        rig_unknowns(sensors.graph.edges, sensors.constraints, rig.first_T_second, prior));
  EXPECT_LT((covariances.shared_unknowns - known.covariance).norm(), 1e-3 * known.covariance.norm());
  EXPECT_FALSE(rig_from_motions(sensors.constraints, sensors.apart()));
}

// Against differences: what an edge measures when the rig, or what either sensor reads, is another one.
TEST(Rig, EdgesDependOnTheUnknownsAsTheirDerivativesSay) {
  const TwoSensors sensors(1.0);
  const RigPrior prior{nullptr, kKeyframes, 0.06};
  const SharedUnknowns shared = rig_unknowns({}, sensors.constraints, sensors.first_T_second, prior);
  constexpr double kStep = 1e-5;
  for (int unknown = 0; unknown < 6 + 2 * kScaleTerms; ++unknown) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(6 + 2 * kScaleTerms);
    change[unknown] = kStep;
    std::vector<RigConstraint> changed = sensors.constraints;
    const auto rescale = [](Pose& pose, const Eigen::VectorXd& factors) {
      pose = scale_corrected({{0, 1, pose}}, factors).front().from_T_to;
    };
    for (RigConstraint& constraint : changed) {
      rescale(constraint.first_keyframe_T_sensor, change.segment(6, kScaleTerms));
      rescale(constraint.second_keyframe_T_sensor, change.tail(kScaleTerms));
    }
    const auto before = rig_edges(sensors.constraints, sensors.first_T_second),
               after = rig_edges(changed, sensors.first_T_second * se3_exp(change.head<6>()));
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Vector6d difference = se3_log(before[i].from_T_to.inverse() * after[i].from_T_to) / kStep;
      EXPECT_LT((difference - shared.edge_by_unknown[i].col(unknown)).norm(), 1e-3) << unknown;
    }
  }
}

}  // namespace
}  // namespace gelslam
