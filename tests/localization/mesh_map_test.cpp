#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <random>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/surface/contact_overlap.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

/// A pebble of 10 mm, which few touches cover.
const Mesh& pebble() {
  static const Mesh mesh = [] {
    ShapeSpec spec;
    spec.name = "pebble";
    spec.size = 0.5;
    return make_shape(spec)->mesh(0.15F);
  }();
  return mesh;
}

const MeshMap& pebble_map() {
  static const MeshMap map = [] {
    NoProgress progress;
    return make_mesh_map(pebble(), {}, progress);
  }();
  return map;
}

/// What the gel shows of the pebble from about there, settled.
PosedSurface touch_of_pebble(const Pose& object_T_sensor) {
  static const ShapePtr shape = make_mesh_shape(pebble());
  const SensorGeometry geometry;
  const Pose sensor_T_object = *settle_object(*shape, object_T_sensor.inverse(), 0.5, geometry);
  const GelShape gel = press_object(*shape, sensor_T_object, geometry);
  std::array<cv::Mat1f, 2> slope;
  cv::split(gel.slope, slope.data());
  cv::Mat1b touched(gel.height_mm < -0.1);
  return {0, sensor_T_object.inverse(),
          GradientSurfaces({touched.size(), 0.0634}).make(slope[0], slope[1], touched)};
}

Pose looking_inward(const Eigen::Vector3d& direction, double twist_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_of_z_to(-direction) * so3_exp({0, 0, twist_rad});
  pose.translation() = 5 * direction;
  return pose;
}

/// Mean distance of a touch's points from the pebble, along the sensor's axis.
double distance_mm(const PosedSurface& touch) {
  static const ShapePtr shape = make_mesh_shape(pebble());
  const std::vector<Eigen::Vector3d> points = coarse_contact_points_mm(*touch.surface.get());
  const Eigen::Vector3f axis = touch.map_T_keyframe.linear().col(2).cast<float>();
  double sum_mm = 0;
  for (const Eigen::Vector3d& point : points) {
    constexpr float kBefore = 3;
    const Eigen::Vector3f from = (touch.map_T_keyframe * point).cast<float>() - kBefore * axis;
    sum_mm += std::abs(static_cast<double>(shape->intersect(from, axis, 10) - kBefore));
  }
  return sum_mm / static_cast<double>(points.size());
}

TEST(MeshMap, ItsTouchesCoverTheSurfaceAndLieOnIt) {
  const MeshMap& map = pebble_map();
  EXPECT_GT(map.covered_share, 0.6);
  EXPECT_GT(map.patches.size(), 20u);
  EXPECT_LT(map.patches.size(), 300u);
  for (const PosedSurface& patch : map.patches) EXPECT_LT(distance_mm(patch), 0.1) << patch.id;
}

TEST(MeshMap, WhatANearCameraSeesOfADomedGelLiesOnTheSurface) {
  MeshMapOptions few, near;
  few.max_touches = near.max_touches = 12;
  near.camera.optics = {.lens_k1 = 0.04, .camera_distance_mm = 12, .gel_dome_per_mm = {0.004, 0.006}};
  NoProgress progress;
  const auto mean_mm = [&](const MeshMapOptions& options) {
    double sum_mm = 0;
    for (const PosedSurface& patch : make_mesh_map(pebble(), options, progress).patches)
      sum_mm += distance_mm(patch) / options.max_touches;
    return sum_mm;
  };
  EXPECT_LT(mean_mm(near), 1.2 * mean_mm(few));
}

TEST(MeshMap, AnObjectThatWasNeverTouchedIsFound) {
  const auto map = std::make_shared<const SurfaceMap>(pebble_map().patches, SlamOptions{});
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  int right = 0;
  constexpr int kTouches = 8;
  for (int k = 0; k < kTouches; ++k) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const PosedSurface truth = touch_of_pebble(looking_inward(direction, k));
    Localizer localizer(map, {});
    const Localization found = *localizer.process(0, 0, truth.surface.get()).localization;
    if (found.hypotheses.empty()) continue;
    const bool is_right = pose_distance_mm(found.hypotheses.front().map_T_sensor.pose, truth.map_T_keyframe,
                                           Eigen::Vector3d::Zero()) < 0.5;
    right += is_right;
    EXPECT_TRUE(is_right || found.status != PlaceStatus::localized) << k;
  }
  EXPECT_GE(right, kTouches * 2 / 3);
}

TEST(MeshMap, AFolderOfItIsReadBack) {
  const test::TemporaryFolder folder;
  MeshMap map = pebble_map();
  map.patches.resize(3);
  write_map(folder.path(), map, pebble(), "pebble.stl");
  const std::vector<PosedSurface> back = posed_surfaces(read_map(folder.path()));
  ASSERT_EQ(back.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(back[i].map_T_keyframe.isApprox(map.patches[i].map_T_keyframe, 1e-12));
    EXPECT_EQ(back[i].surface->contact_pixels, map.patches[i].surface->contact_pixels);
  }
}

TEST(MeshMap, MeshesThatCannotBeMeasuredAreRefused) {
  NoProgress progress;
  EXPECT_THROW(make_mesh_map({}, {}, progress), Error);
  Mesh tiny = pebble();
  for (Eigen::Vector3f& vertex : tiny.vertices_mm) vertex *= 0.001F;
  EXPECT_THAT(test::message_of([&] { make_mesh_map(tiny, {}, progress); }), testing::HasSubstr("unit"));
  Mesh turned = pebble();
  for (std::size_t k = 0; k < turned.triangles.size(); k += 2)
    std::swap(turned.triangles[k][0], turned.triangles[k][1]);
  MeshMapOptions few;
  few.max_touches = 5;
  const std::string said =
      test::message_of([&] { throw Error(make_mesh_map(turned, few, progress).warning); });
  EXPECT_THAT(said, testing::HasSubstr("% of the mesh's edges one triangle faces inward and one outward"));
  EXPECT_THAT(pebble_map().warning, testing::Not(testing::HasSubstr("faces inward")));
  Mesh broken = pebble();
  broken.triangles.front()[0] = 1 << 30;
  EXPECT_THROW(make_mesh_map(broken, {}, progress), Error);
}

}  // namespace
}  // namespace gelslam
