#include "motion_forest.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "gelslam/backend/uncertain_motion.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

using namespace backend::detail;

// A tree with branches and edges in both directions.
struct Tree {
  std::vector<Pose> truth;
  std::vector<std::pair<int, int>> joins;

  Tree() {
    for (int i = 0; i < 30; ++i) truth.push_back(rolled(i, 7));
    for (int i = 1; i < 30; ++i) {
      const int parent = i % 7 == 0 ? i / 2 : i - 1;
      joins.push_back(i % 3 == 0 ? std::pair{i, parent} : std::pair{parent, i});
    }
  }
  UncertainMotion motion(std::size_t join, const Vector6d& noise = Vector6d::Zero()) const {
    const auto [from, to] = joins[join];
    PoseGraphEdge edge{from, to,
                       truth[static_cast<std::size_t>(from)].inverse() * truth[static_cast<std::size_t>(to)]};
    edge.from_T_to = edge.from_T_to * se3_exp(noise);
    edge.information = information_of(0.004, 0.03);
    return uncertain_motion(edge);
  }
  MotionForest forest(const std::vector<UncertainMotion>& motions) const {
    std::vector<MotionForest::Edge> edges;
    for (std::size_t i = 0; i < motions.size(); ++i)
      edges.push_back({joins[i].first, joins[i].second, &motions[i]});
    return MotionForest(static_cast<int>(truth.size()), edges);
  }
};

// Against many draws of the edges' noise. 300 draws know a variance to 8 %; 40 % is five of those.
TEST(MotionForest, CovarianceIsThatOfManyDraws) {
  const Tree tree;
  constexpr int kDraws = 300;
  const std::pair<int, int> ends[] = {{20, 27}, {27, 20}, {5, 29}, {0, 13}};
  Matrix6d sampled[4], promised[4];
  for (Matrix6d& sum : sampled) sum.setZero();
  for (int draw = 0; draw < kDraws; ++draw) {
    Noise noise(static_cast<std::uint64_t>(draw));
    std::vector<UncertainMotion> motions;
    for (std::size_t i = 0; i < tree.joins.size(); ++i)
      motions.push_back(tree.motion(i, noise.tangent(0.004, 0.03)));
    const MotionForest forest = tree.forest(motions);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto [a, b] = ends[k];
      const UncertainMotion path = forest.path(a, b);
      const Vector6d error =
          se3_log(path.from_T_to.inverse() * tree.truth[static_cast<std::size_t>(a)].inverse() *
                  tree.truth[static_cast<std::size_t>(b)]);
      sampled[k] += error * error.transpose() / kDraws;
      promised[k] = path.covariance;
    }
  }
  for (std::size_t k = 0; k < 4; ++k)
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(sampled[k](i, i) / promised[k](i, i), 1.0, 0.4) << k << ' ' << i;
}

TEST(MotionForest, AnEdgeAndItsInverseSayTheSame) {
  const Tree tree;
  std::vector<UncertainMotion> motions, turned;
  for (std::size_t i = 0; i < tree.joins.size(); ++i) motions.push_back(tree.motion(i));
  Tree other = tree;
  for (std::size_t i = 0; i < tree.joins.size(); ++i) {
    if (i % 2 == 1) std::swap(other.joins[i].first, other.joins[i].second);
    turned.push_back(i % 2 == 1 ? inverse(motions[i]) : motions[i]);
  }
  const UncertainMotion path = tree.forest(motions).path(20, 27), same = other.forest(turned).path(20, 27);
  EXPECT_TRUE(path.covariance.isApprox(same.covariance, 1e-9));
  EXPECT_TRUE(path.by_scale.isApprox(same.by_scale, 1e-9));
}

// The same against motions that a sensor with a scale would have read.
TEST(MotionForest, KnowsWhatAGradientScaleDoes) {
  constexpr double kScale = 1e-3;
  const Graph plain = roll_of_400_degrees({1, 1}, false), read = roll_of_400_degrees({1 + kScale, 1}, false);
  std::vector<UncertainMotion> a, b;
  std::vector<MotionForest::Edge> edges_a, edges_b;
  for (const PoseGraphEdge& edge : plain.edges) a.push_back(uncertain_motion(edge));
  for (const PoseGraphEdge& edge : read.edges) b.push_back(uncertain_motion(edge));
  for (std::size_t i = 0; i < a.size(); ++i) {
    edges_a.push_back({plain.edges[i].from, plain.edges[i].to, &a[i]});
    edges_b.push_back({read.edges[i].from, read.edges[i].to, &b[i]});
  }
  const UncertainMotion true_path = MotionForest(101, edges_a).path(10, 60),
                        read_path = MotionForest(101, edges_b).path(10, 60);
  const Vector6d change = se3_log(true_path.from_T_to.inverse() * read_path.from_T_to);
  EXPECT_GT(change.norm(), 1e-3);  // 200 degrees by a thousandth: 0.0035 rad
  EXPECT_LT((change + kScale * true_path.by_scale.col(0)).norm(), 0.02 * change.norm());
}

// By the formulas for a straight chain: noise adds up by its squares, what a scale does simply adds up.
TEST(MotionCertainty, OfAChainIsWhatItsEdgesSay) {
  std::vector<PoseGraphEdge> edges;
  for (int i = 0; i < 16; ++i) {
    PoseGraphEdge edge{10 * i, 10 * i + 10, Pose::Identity(), information_of(1e-6, 0.03)};
    edge.information.diagonal().tail<2>().setConstant(1e4);
    edges.push_back(edge);
  }
  edges.push_back({500, 510, Pose::Identity(), information_of(0.01, 0.1)});
  const MotionCertainty certainty(edges, 0.0);
  EXPECT_NEAR(certainty.sigma_mm(0, 160), 4 * 0.03, 1e-3);
  EXPECT_NEAR(certainty.sigma_mm(110, 20), 3 * 0.03, 1e-3);
  EXPECT_EQ(certainty.sigma_mm(0, 500), std::numeric_limits<double>::infinity());
  EXPECT_EQ(certainty.sigma_mm(0, 77), std::numeric_limits<double>::infinity());

  // Once round a ball: a scale common to all edges does more than their noise, until a loop tells where the
  // round ends.
  Graph roll = roll_of_400_degrees({1, 1}, false);
  const double noise_only = MotionCertainty(roll.edges, 0.0).sigma_mm(0, 89);
  EXPECT_GT(MotionCertainty(roll.edges, 0.1).sigma_mm(0, 89), 2 * noise_only);
  roll.join(0, 90, EdgeKind::loop);
  EXPECT_LT(MotionCertainty(roll.edges, 0.1).sigma_mm(0, 89), 0.5 * noise_only);
}

}  // namespace
}  // namespace gelslam
