#pragma once

#include <memory>
#include <string>

#include "gelslam/slam/sensor_rig.hpp"
#include "tracked_sensor.hpp"

namespace gelslam {

/// A line of the stream, "" for none, and whether the frame has a pose.
struct PoseLine {
  std::string text;
  bool has_pose = false;
};

class PoseOutput {
 public:
  virtual ~PoseOutput() = default;
  virtual PoseLine line(const SurfaceStream::Item& item) = 0;
  /// What was not right with the poses, or "". At the end.
  virtual std::string warning() const { return ""; }
};

/// Poses in the frame of the trial, or, as TUM, of the first contact.
std::unique_ptr<PoseOutput> make_trial_output(const SlamOptions& options, bool as_ndjson);

/// Poses in the frame of a map, and what `touches` (or null) shows of them. Of two sensors (`second` is not
/// null), poses of the first one that both know; `rig` has a pose then.
std::unique_ptr<PoseOutput> make_map_output(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options,
                                            bool as_ndjson, LocatedTouches* touches, SecondSensor* second,
                                            const RigPose& rig);

}  // namespace gelslam
