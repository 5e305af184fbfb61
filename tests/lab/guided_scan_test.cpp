#include "guided_scan.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/core/parallel.hpp"
#include "simulated_frames.hpp"
#include "virtual_hand.hpp"

namespace gelslam::lab {
namespace {

ShapePtr stone(float size) {
  ShapeSpec spec;
  spec.name = "pebble";
  spec.size = size;
  return make_mesh_shape(make_shape(spec)->mesh(0.2F));
}

TEST(VirtualHand, RollsTheObjectAtItsSpeedAndKeepsTheTouchInTheMiddle) {
  constexpr double kSpeedMmS = 5;
  constexpr int kFrames = 50;
  const SensorGeometry geometry;
  VirtualHand hand(stone(0.6F), geometry, kSpeedMmS, 1);
  hand.put({0, 0, 1});
  for (int i = 0; i < 8; ++i) hand.move({1, 0});
  const Pose start = hand.sensor_T_object();
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_TRUE(hand.move({1, 0}));
    double lowest = 0;
    cv::minMaxLoc(hand.press().height_mm, &lowest);
    EXPECT_LT(lowest, -0.2);
    EXPECT_GT(lowest, -0.8);
  }
  const Eigen::AngleAxisd turned(hand.sensor_T_object().linear() * start.linear().transpose());
  const double path_mm = turned.angle() * start.translation().z(),
               wanted_mm = kSpeedMmS * kFrames / VirtualHand::kRateHz;
  EXPECT_GT(path_mm, 0.6 * wanted_mm);
  EXPECT_LT(path_mm, 1.2 * wanted_mm);
  EXPECT_GT(turned.axis().y(), 0.7) << "what lay toward +x comes down";
}

TEST(VirtualHand, StaysOnAFlatObject) {
  ShapeSpec spec;
  spec.name = "plank";
  spec.size = 0.5;
  VirtualHand hand(make_mesh_shape(make_shape(spec)->mesh(0.3F)), {}, 20, 1);
  hand.put({0, 0, 1});
  bool went = true;
  for (int i = 0; i < 60 && went; ++i) went = hand.move({1, 0});
  EXPECT_FALSE(went) << "the plate ends there";
  EXPECT_NEAR(std::abs(hand.place_mm().x()), hand.reach_mm().x(), 0.5);
}

/// Whether the arrow covers more than a walk at random is for the study, on many objects and seeds.
TEST(GuidedScan, GrowsAMeshOnTheObject) {
  ShapeSpec spec;
  spec.name = "pebble";
  spec.size = 0.5;
  const GuidanceObject object = make_guidance_object(spec);
  simulated_frames();  // made once
  EXPECT_GT(object.points_mm.size(), 2000U) << "most of a stone can be touched";
  std::array<GuidedScanResult, 2> results;
  parallel_for(2, 0, [&](std::size_t i) {
    const HandPattern pattern = i == 0 ? HandPattern::guided : HandPattern::random;
    results[i] = scan_with_hand(object, simulated_frames().model, {pattern, 150, 6, 2});
  });
  for (const GuidedScanResult& result : results) {
    ASSERT_GE(result.coverage.size(), 3U);
    EXPECT_GT(result.coverage.back(), 1.5 * result.coverage.front()) << "the hand goes on";
    EXPECT_LT(result.mesh_mm, 0.05);
    EXPECT_TRUE(frames_to(result, result.coverage.front()));
    EXPECT_FALSE(frames_to(result, 1.01));
  }
  EXPECT_NE(results[0].coverage, results[1].coverage);
}

}  // namespace
}  // namespace gelslam::lab
