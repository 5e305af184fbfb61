#include "simulated_frames.hpp"

#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam::lab {
namespace {

constexpr int kFrames = 96;

SimulatedFrames make() {
  ScanSpec spec;
  spec.object.name = "peanut";
  spec.motion.frame_rate_hz = 8 * 25;  // Eight frames are 0.1 mm.
  spec.motion.frames = 8 * 120;
  const Simulator simulator(spec);
  SimulatedFrames frames;
  frames.model = flat_sensor_model();
  frames.background = simulator.frame(0).bgr;
  SurfaceEstimator estimator(frames.model, frames.background, SurfaceOptions{});
  for (int i = 0; i < kFrames; ++i) {
    frames.pictures.push_back(simulator.frame(simulator.frame_count() - kFrames + i).bgr);
    frames.surfaces.push_back(estimator.estimate(frames.pictures.back()));
  }
  return frames;
}

}  // namespace

GradientModel flat_sensor_model() {
  const std::string_view file = flat_model_file();
  return parse_model_file({reinterpret_cast<const unsigned char*>(file.data()), file.size()}, "flat.json")
      .model;
}

cv::Mat3b bare_gel(const Optics& optics) {
  cv::Mat3b picture;
  optics.background().convertTo(picture, CV_8U);
  return picture;
}

const SimulatedFrames& simulated_frames() {
  static const SimulatedFrames frames = make();
  return frames;
}

}  // namespace gelslam::lab
