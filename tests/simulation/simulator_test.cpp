// Whole scans: pictures, poses and object must tell one story.

#include "gelslam/simulation/simulator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

namespace gelslam {
namespace {

ScanSpec scan(const std::string& object, const std::string& motion, int frames) {
  ScanSpec spec;
  spec.object.name = object;
  spec.motion.name = motion;
  spec.motion.frames = frames;
  return spec;
}

double lowest(const SimulatedFrame& frame) {
  double low = 0;
  cv::minMaxLoc(frame.height_mm, &low);
  return low;
}

TEST(Simulator, ContactPointsLieOnTheObjectAtItsStartPose) {
  const Simulator simulator(scan("pebble", "wobble", 60));
  const Pose object_T_start = simulator.start_T_object().inverse();
  const SensorGeometry& sensor = simulator.spec().geometry;
  for (const int index : {10, 35, 69}) {
    const SimulatedFrame frame = simulator.frame(index);
    ASSERT_TRUE(frame.start_T_sensor);
    int checked = 0;
    for (int v = 0; v < sensor.height_px; v += 3)
      for (int u = 0; u < sensor.width_px; u += 3) {
        if (frame.contact(v, u) == 0) continue;
        const Eigen::Vector3d point(sensor.x_mm(u), sensor.y_mm(v), frame.height_mm(v, u));
        const Eigen::Vector3d on_object = object_T_start * *frame.start_T_sensor * point;
        // From 0.2 mm before the point, looking along the sensor's axis, the object is 0.2 mm away.
        const Eigen::Vector3d along = (object_T_start * *frame.start_T_sensor).linear().col(2);
        const float t =
            simulator.shape().intersect((on_object - 0.2 * along).cast<float>(), along.cast<float>(), 1.0F);
        ASSERT_NEAR(t, 0.2F, 2e-3F);
        ++checked;
      }
    EXPECT_GT(checked, 20);
  }
}

TEST(Simulator, FirstContactIsTheStartAndBackgroundHasNoPose) {
  const Simulator simulator(scan("sphere", "wobble", 10));
  EXPECT_EQ(simulator.frame_count(), 20);
  for (int index = 0; index < 10; ++index) EXPECT_FALSE(simulator.frame(index).start_T_sensor);
  EXPECT_EQ(simulator.contact_start_frame(), 10);
  const SimulatedFrame first = simulator.frame(10);
  ASSERT_TRUE(first.start_T_sensor);
  EXPECT_LT((first.start_T_sensor->matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
  EXPECT_EQ(cv::countNonZero(simulator.frame(3).height_mm), 0);
}

TEST(Simulator, SameSeedSamePicturesInAnyOrder) {
  const ScanSpec spec = scan("peanut", "wobble", 20);
  const Simulator a(spec), b(spec);
  const cv::Mat3b late = a.frame(25).bgr, early = a.frame(12).bgr;
  EXPECT_EQ(cv::norm(b.frame(12).bgr, early, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(b.frame(25).bgr, late, cv::NORM_INF), 0);
  ScanSpec other = spec;
  other.motion.seed = 2;
  EXPECT_GT(
      (Simulator(other).frame(25).sensor_T_object.matrix() - a.frame(25).sensor_T_object.matrix()).norm(),
      1e-3);
  other = spec;
  other.optics.seed = 2;
  EXPECT_GT(cv::norm(Simulator(other).frame(25).bgr, late, cv::NORM_INF), 0);
}

class EveryMotion : public testing::TestWithParam<std::string> {};

TEST_P(EveryMotion, MovesSmoothlyAtABearableDepth) {
  ScanSpec spec = scan("pebble", GetParam(), 300);
  spec.geometry = {160, 120, 2 * spec.geometry.pixel_pitch_mm};  // the same view, drawn sooner
  const Simulator simulator(spec);
  const bool lifts = GetParam() == "breaks" || GetParam() == "tour";
  // All over in 300 frames is fast: at its ends the object spins about where it touches.
  const double most_rad = GetParam() == "allover" ? 0.7 : 0.04;
  Pose previous = simulator.frame(10).sensor_T_object;
  int off = 0, on = 0;
  for (int index = 11; index < simulator.frame_count(); index += 1) {
    if (index % 25 > 1) continue;  // pairs of neighbors, here and there
    const SimulatedFrame frame = simulator.frame(index);
    if (index % 25 == 1) {
      const Pose step = previous.inverse() * frame.sensor_T_object;
      EXPECT_LT(rotation_angle_rad(step), most_rad) << index;
      EXPECT_LT((frame.sensor_T_object.translation() - previous.translation()).head<2>().norm(), 0.3)
          << index;
    }
    previous = frame.sensor_T_object;
    EXPECT_GT(lowest(frame), -1.2);
    (frame.start_T_sensor ? on : off)++;
    EXPECT_EQ(frame.start_T_sensor.has_value(), cv::countNonZero(frame.contact) > 0);
  }
  EXPECT_GT(on, 15);
  EXPECT_EQ(off > 0, lifts);
}

std::vector<std::string> motions() {
  std::vector<std::string> all;
  for (const CatalogEntry& entry : motion_catalog()) all.push_back(entry.name);
  return all;
}
INSTANTIATE_TEST_SUITE_P(Catalog, EveryMotion, testing::ValuesIn(motions()),
                         [](const auto& info) { return info.param; });

TEST(Simulator, AllOverTouchesEverySideAndComesBack) {
  ScanSpec spec = scan("pebble", "allover", 400);
  spec.object.size = 0.5;
  spec.motion.indentation_mm = 0.8;
  const Simulator simulator(spec);
  const SensorGeometry& sensor = simulator.spec().geometry;
  std::vector<Eigen::Vector3d> touched;  // directions from the object's center
  for (int index = 14; index < simulator.frame_count(); index += 10) {
    const SimulatedFrame frame = simulator.frame(index);
    for (int v = 0; v < sensor.height_px; v += 12)
      for (int u = 0; u < sensor.width_px; u += 12)
        if (frame.contact(v, u))
          touched.push_back((frame.sensor_T_object.inverse() *
                             Eigen::Vector3d(sensor.x_mm(u), sensor.y_mm(v), frame.height_mm(v, u)))
                                .normalized());
  }
  constexpr int kDirections = 200;
  for (int k = 0; k < kDirections; ++k) {  // a spiral of directions that lie evenly
    const double z = 1 - (2 * k + 1.0) / kDirections, turn = std::numbers::phi * 2 * std::numbers::pi * k;
    const Eigen::Vector3d direction(std::sqrt(1 - z * z) * std::cos(turn),
                                    std::sqrt(1 - z * z) * std::sin(turn), z);
    double nearest = 0;
    for (const Eigen::Vector3d& other : touched) nearest = std::max(nearest, direction.dot(other));
    EXPECT_GT(nearest, std::cos(0.25)) << direction.transpose();
  }
  const auto rotation = [&](int index) { return simulator.frame(index).sensor_T_object.linear(); };
  EXPECT_LT(so3_log(rotation(10) * rotation(simulator.frame_count() - 1).transpose()).norm(), 0.3);
}

}  // namespace
}  // namespace gelslam
