#pragma once

#include <memory>
#include <string>

#include "gelslam/localization/localizer.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/viewer/map_window.hpp"

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
};

/// Poses in the frame of the trial, or, as TUM, of the first contact.
std::unique_ptr<PoseOutput> make_trial_output(const SlamOptions& options, bool as_ndjson);

/// Poses in the frame of a map, and what `touches` (or null) shows of them.
std::unique_ptr<PoseOutput> make_map_output(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options,
                                            bool as_ndjson, LocatedTouches* touches);

}  // namespace gelslam
