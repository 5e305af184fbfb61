#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam::lab {

/// What decides where the virtual hand goes.
enum class HandPattern {
  guided,  ///< it follows the arrow of the live window (guide())
  fixed,   ///< a helix from end to end and back; over a flat object, line by line
  random,  ///< a random walk
};

/// An object, and how much of it a hand can touch.
struct GuidanceObject {
  std::string name;
  ShapePtr shape;
  Mesh truth;                              ///< object frame, mm
  std::vector<Eigen::Vector3d> points_mm;  ///< spread evenly over what can be touched
};
GuidanceObject make_guidance_object(const ShapeSpec& spec);

struct GuidedScanSpec {
  HandPattern pattern = HandPattern::guided;
  int frames = 1500;
  double speed_mm_s = 6;
  std::uint64_t seed = 1;
};

struct GuidedScanResult {
  std::vector<double> coverage;  ///< every kCoverageFrames: share of points within 0.15 mm of the live mesh
  int lost = 0, trials = 0, components = 0, loops = 0;
  double mesh_mm = 0;  ///< mean distance of the final mesh to the object, at the pose of the anchor
  double drift_mm = 0, worst_drift_mm = 0;  ///< of the final poses: RMS, maximum
};
constexpr int kCoverageFrames = 50;

/// A scan, frame by frame, with the whole chain; the hand goes where it is told by what is known so far.
/// Deterministic.
GuidedScanResult scan_with_hand(const GuidanceObject& object, const GradientModel& model,
                                const GuidedScanSpec& spec);

/// Frames until that share was covered; nothing where it was not.
std::optional<int> frames_to(const GuidedScanResult& result, double share);

}  // namespace gelslam::lab
