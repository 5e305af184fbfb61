// Times of solving the pose graph in a live scan: with a known solution, plus one new keyframe or edge.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/backend/uncertain_motion.hpp"

namespace {

using namespace gelslam;

constexpr double kSigmaRad = 0.003;
constexpr double kSigmaMm = 0.05;

struct Scan {
  std::map<int, Pose> poses;
  std::vector<PoseGraphEdge> edges;
};

Vector6d noise(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = normal(random) * (i < 3 ? kSigmaRad : kSigmaMm);
  return xi;
}

// A ball of 40 mm radius that is rolled in a spiral. Each turn touches the previous turns, so edges connect
// neighbors in time and neighbors in space, as in a real scan.
Pose pose_on_ball(int keyframe, int per_turn) {
  const double turn = 2 * M_PI * keyframe / per_turn, rise = 0.02 * turn;
  Pose pose = Pose::Identity();
  pose.linear() = so3_exp({0, turn, 0}) * so3_exp({rise, 0, 0});
  pose.translation() = pose.linear() * Eigen::Vector3d(0, 0, -40);
  return pose;
}

Scan make_scan(int nodes, int loops, std::uint64_t seed) {
  constexpr int kPerTurn = 60;
  std::mt19937_64 random(seed);
  Vector6d sigma;
  sigma << kSigmaRad, kSigmaRad, kSigmaRad, kSigmaMm, kSigmaMm, kSigmaMm;
  const Matrix6d information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  Scan scan;
  const auto edge = [&](int from, int to, EdgeKind kind) {
    const Pose measured =
        pose_on_ball(from, kPerTurn).inverse() * pose_on_ball(to, kPerTurn) * se3_exp(noise(random));
    scan.edges.push_back({from, to, measured, information, kind});
  };
  for (int i = 0; i < nodes; ++i) {
    scan.poses[i] = i == 0 ? pose_on_ball(0, kPerTurn) : scan.poses[i - 1] * scan.edges.back().from_T_to;
    if (i + 1 < nodes) edge(i, i + 1, EdgeKind::odometry);
  }
  for (int k = 0; k < loops; ++k) {
    const int turns = 1 + static_cast<int>(random() % 3);
    const int to =
        kPerTurn * turns + static_cast<int>(random() % static_cast<std::uint64_t>(nodes - kPerTurn * turns));
    edge(to - kPerTurn * turns, to, EdgeKind::loop);
  }
  return scan;
}

void solve_from_scratch(benchmark::State& state) {
  const Scan scan = make_scan(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), 1);
  PoseGraphOptions options;
  SharedUnknowns shared;
  int iterations = 0;
  for (auto _ : state) {
    if (state.range(2) != 0) shared = gradient_scale_unknowns(scan.edges, 0.1);
    iterations = solve_pose_graph(scan.poses, scan.edges, options, shared).iterations;
  }
  state.counters["iterations"] = iterations;
}

void solve_one_more_keyframe(benchmark::State& state) {
  const int nodes = static_cast<int>(state.range(0));
  Scan scan = make_scan(nodes, static_cast<int>(state.range(1)), 1);
  PoseGraphOptions options;
  Scan before = scan;
  before.poses.erase(nodes - 1);
  std::erase_if(before.edges,
                [&](const PoseGraphEdge& e) { return e.from == nodes - 1 || e.to == nodes - 1; });
  std::map<int, Pose> warm = solve_pose_graph(before.poses, before.edges, options).component_T_node;
  warm[nodes - 1] = warm[nodes - 2] * scan.edges[static_cast<std::size_t>(nodes - 2)].from_T_to;
  int iterations = 0;
  for (auto _ : state) iterations = solve_pose_graph(warm, scan.edges, options).iterations;
  state.counters["iterations"] = iterations;
}

BENCHMARK(solve_from_scratch)
    ->Name("backend/solve_from_scratch")
    ->ArgNames({"nodes", "loops", "gain"})
    ->Args({700, 2500, 0})
    ->Args({5000, 7000, 0})
    ->Args({5000, 7000, 1})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(solve_one_more_keyframe)
    ->Name("backend/solve_one_more_keyframe")
    ->ArgNames({"nodes", "loops"})
    ->Args({700, 2500})
    ->Args({5000, 7000})
    ->Unit(benchmark::kMillisecond);

}  // namespace
