#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "mesh_checks.hpp"
#include "synthetic_touch.hpp"

namespace gelslam {
namespace {

using namespace test;  // NOLINT
using ::testing::ElementsAre;

PosedSurface pressed(int id, const Shape& shape, const Eigen::Vector3d& side, double depth_mm) {
  const Pose pose = press(shape, side, depth_mm, 0.1 * id);
  return {id, pose, touch(shape, pose)};
}

TEST(Coverage, OfTheSamePatchTwiceOneIsKept) {
  const Shape ball = sphere(6);
  auto first = pressed(3, ball, {0, 0, 1}, 1.0);
  auto second = first;
  second.id = 7;
  EXPECT_THAT(select_coverage_keyframes({second, first}, {}), ElementsAre(3));
}

TEST(Coverage, PatchesApartAreAllKept) {
  const Shape ball = sphere(6);
  EXPECT_THAT(select_coverage_keyframes({pressed(0, ball, {0, 0, 1}, 0.6), pressed(1, ball, {1, 0, 0}, 0.6),
                                         pressed(2, ball, {0, 1, -1}, 0.6)},
                                        {}),
              ElementsAre(0, 1, 2));
}

TEST(Coverage, BothSidesOfAThinPlateAreKept) {
  const Shape plate = slab({7, 5, 0.2}, 0.1);
  EXPECT_THAT(
      select_coverage_keyframes({pressed(0, plate, {0, 0, 1}, 0.3), pressed(1, plate, {0, 0, -1}, 0.3)}, {}),
      ElementsAre(0, 1));
}

TEST(Coverage, ASmallPatchInsideALargeOneIsDropped) {
  const Shape ball = sphere(6);
  const std::vector<PosedSurface> patches{pressed(0, ball, {0, 0, 1}, 0.4),
                                          pressed(1, ball, {0, 0.05, 1}, 1.0),
                                          pressed(2, ball, {0, 1, 0}, 0.5)};
  EXPECT_THAT(select_coverage_keyframes(patches, {}), ElementsAre(1, 2));
}

TEST(Coverage, WhatIsKeptCoversAsMuchAsAllInAnyOrder) {
  const Shape ball = sphere(6);
  std::vector<PosedSurface> patches;
  Gaussian noise(3);
  for (int i = 0; i < 30; ++i) {
    const double turn = 1.0 * i / 30;
    const Pose pose = press(ball, {0, std::sin(turn), std::cos(turn)}, 0.8, 0.1 * i);
    patches.push_back(with_errors(i, ball, pose, {0.003, 0.04, 0.03, 0.0}, noise));
  }
  const std::vector<int> ids = select_coverage_keyframes(patches, {});
  EXPECT_LT(ids.size(), 15u);
  std::vector<PosedSurface> kept;
  for (const int id : ids) kept.push_back(patches[static_cast<std::size_t>(id)]);
  const Mesh all = fuse(patches, {}), few = fuse(kept, {});
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : all.vertices_mm) points.push_back(p.cast<double>());
  EXPECT_GT(covered_share(few, points, 0.3), 0.99);

  std::reverse(patches.begin(), patches.end());
  EXPECT_EQ(select_coverage_keyframes(patches, {}), ids);
}

TEST(Coverage, NothingInNothingOut) {
  EXPECT_TRUE(select_coverage_keyframes({}, {}).empty());
  CoverageOptions options;
  options.max_distance_mm = 0;
  EXPECT_THROW(select_coverage_keyframes({}, options), Error);
}

}  // namespace
}  // namespace gelslam
