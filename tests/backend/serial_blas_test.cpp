#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "synthetic_graph.hpp"

namespace {

std::atomic<int> threads{8};

}  // namespace

/// In front of those of OpenBLAS, if that is there.
extern "C" __attribute__((visibility("default"))) int openblas_get_num_threads() { return threads; }
extern "C" __attribute__((visibility("default"))) void openblas_set_num_threads(int count) {
  threads = count;
}

namespace gelslam {
namespace {

/// It has one number of threads for the whole process.
TEST(PoseGraph, SolvesAtOnceLeaveTheThreadsOfBlasAsTheyWere) {
  const Graph graph = roll_of_400_degrees({}, true);
  const auto solve = [&] {
    for (int i = 0; i < 40; ++i) {
      solve_pose_graph(graph.chained(), graph.edges, PoseGraphOptions{});
      std::this_thread::yield();
    }
  };
  std::thread other(solve), third(solve);
  solve();
  other.join();
  third.join();
  EXPECT_EQ(threads, 8);
}

}  // namespace
}  // namespace gelslam
