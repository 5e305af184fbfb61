#include "gelslam/backend/g2o.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

class G2o : public testing::Test {
 protected:
  std::vector<std::vector<std::string>> words_of(const std::string& name) const {
    std::ifstream in(folder_ / name);
    std::vector<std::vector<std::string>> lines;
    for (std::string line; std::getline(in, line);) {
      std::istringstream words(line);
      lines.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
    }
    return lines;
  }

  const test::TemporaryFolder folder_;
};

Pose pose_in_meters(const std::vector<std::string>& words, std::size_t first) {
  const auto number = [&](std::size_t i) { return std::stod(words.at(first + i)); };
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(number(0), number(1), number(2));
  pose.linear() = Eigen::Quaterniond(number(6), number(3), number(4), number(5)).toRotationMatrix();
  return pose;
}

TEST_F(G2o, WritesVerticesGaugesAndEdgesInMeters) {
  Graph graph;
  for (int i = 0; i < 4; ++i) graph.truth[i] = rolled(i, 8);
  graph.join(0, 1, EdgeKind::odometry);
  graph.join(2, 3, EdgeKind::odometry);
  write_g2o(folder_ / "a.g2o", graph.truth, graph.edges);
  const auto lines = words_of("a.g2o");
  ASSERT_EQ(lines.size(), 4u + 2u + 2u);
  EXPECT_EQ(lines[3][0], "VERTEX_SE3:QUAT");
  EXPECT_EQ(lines[3][1], "3");
  Pose expected = graph.truth.at(3);
  expected.translation() *= 1e-3;
  EXPECT_TRUE(pose_in_meters(lines[3], 2).isApprox(expected, 1e-12));
  EXPECT_EQ(lines[4], (std::vector<std::string>{"FIX", "0"}));
  EXPECT_EQ(lines[5], (std::vector<std::string>{"FIX", "2"}));
  EXPECT_EQ(lines[7][0], "EDGE_SE3:QUAT");
  EXPECT_EQ(lines[7][2], "3");
  EXPECT_EQ(lines[7].size(), 3u + 7u + 21u);
}

TEST_F(G2o, EdgesAloneAreTheOnesOfTheGraph) {
  Graph graph;
  for (int i = 0; i < 3; ++i) graph.truth[i] = rolled(i, 8);
  graph.join(0, 1, EdgeKind::odometry);
  graph.join(0, 2, EdgeKind::loop);
  write_g2o(folder_ / "whole.g2o", graph.truth, graph.edges);
  write_g2o_edges(folder_ / "edges.g2o", graph.edges);
  const auto whole = words_of("whole.g2o"), edges = words_of("edges.g2o");
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_EQ(edges, decltype(edges)(whole.end() - 2, whole.end()));
}

// The same error must have the same cost in both conventions. That of g2o is (translation in m, vector part
// of the quaternion).
TEST_F(G2o, AnErrorCostsTheSameInItsConvention) {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = std::sin(3.7 * i + 1);
  std::map<int, Pose> nodes{{0, Pose::Identity()}, {1, Pose::Identity()}};
  PoseGraphEdge edge{0, 1, Pose::Identity(), root.transpose() * root, EdgeKind::loop};
  write_g2o(folder_ / "b.g2o", nodes, {edge});
  const auto words = words_of("b.g2o").back();
  Matrix6d information;
  std::size_t next = 10;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      information(row, column) = information(column, row) = std::stod(words.at(next++));

  const Vector6d noise = 1e-4 * (Vector6d() << 1, -2, 3, 4, 5, -6).finished();
  const Pose error = se3_exp(noise);
  Vector6d g2o_error;
  g2o_error << 1e-3 * error.translation(), Eigen::Quaterniond(error.linear()).vec();
  const double ours = noise.dot(edge.information * noise);
  EXPECT_NEAR(g2o_error.dot(information * g2o_error), ours, 1e-3 * ours);
}

TEST_F(G2o, RefusesUnknownNodesAndUnwritablePlaces) {
  const std::map<int, Pose> nodes{{0, Pose::Identity()}};
  PoseGraphEdge edge;
  edge.to = 1;
  EXPECT_THROW(write_g2o(folder_ / "c.g2o", nodes, {edge}), Error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "c.g2o"));
  EXPECT_THROW(write_g2o(folder_ / "missing" / "c.g2o", nodes, {}), Error);
}

}  // namespace
}  // namespace gelslam
