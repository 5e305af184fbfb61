// The models that are shipped, on scans that no training has seen.

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {
namespace {

ModelFile parsed(std::string_view file) {
  return parse_model_file({reinterpret_cast<const unsigned char*>(file.data()), file.size()}, "model.json");
}

TEST(SensorModels, StateTheOpticsThatTheyAreFor) {
  EXPECT_EQ(parsed(mini_model_file()).model.optics, kGelSightMiniOptics);
  EXPECT_EQ(parsed(flat_model_file()).model.optics, SensorOptics{});
}

TEST(SensorModels, ReadAnUnseenObjectToAFewHundredthsOfAMillimeter) {
  ScanSpec spec;
  spec.object.name = "peanut";
  spec.motion.frames = 20;
  const Simulator simulator(spec);
  SurfaceEstimator estimator(parsed(flat_model_file()).model, simulator.frame(0).bgr, {});
  const SimulatedFrame frame = simulator.frame(25);
  const SurfacePtr surface = estimator.estimate(frame.bgr);
  const double error_mm = cv::norm(surface->height_mm, frame.height_mm, cv::NORM_L1, frame.contact) /
                          cv::countNonZero(frame.contact);
  EXPECT_LT(error_mm, 0.05);
  EXPECT_GT(cv::countNonZero(frame.contact), 1000);
}

}  // namespace
}  // namespace gelslam
