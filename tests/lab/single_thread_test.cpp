#include <gtest/gtest.h>
#include <omp.h>

#include "baselines/baselines.hpp"

namespace gelslam::baselines::detail {
namespace {

/// Threads that a region gets which asks for two by name, as Open3D's regions do.
int threads_of_a_region() {
  int threads = 0;
#pragma omp parallel num_threads(2)
#pragma omp single
  threads = omp_get_num_threads();
  return threads;
}

TEST(SingleThread, OverrulesWhatARegionAsksForAndGivesItBack) {
  const int before = threads_of_a_region();
  EXPECT_EQ(before, 2) << "libgomp gives what is asked for";
  {
    const SingleThread guard;
    EXPECT_EQ(threads_of_a_region(), 1);
    const SingleThread again;
    EXPECT_EQ(threads_of_a_region(), 1);
  }
  EXPECT_EQ(threads_of_a_region(), before);
}

}  // namespace
}  // namespace gelslam::baselines::detail
