#pragma once

#include <memory>
#include <string>

#include "gelslam/localization/localizer.hpp"
#include "gelslam/slam/live_session.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/viewer/map_window.hpp"

namespace gelslam {

/// A frame's lines, "" for none, and what is to be shown of it.
struct PoseLine {
  std::string ndjson, tum;
  bool has_pose = false;
  LiveTouch touch;    ///< its trial's frame is that of the poses
  std::string words;  ///< as those of LiveStatus
};

/// Lines that are asked for; others are left empty.
struct LineFormats {
  bool ndjson = false, tum = false;
};

class PoseOutput {
 public:
  virtual ~PoseOutput() = default;
  virtual PoseLine line(const SurfaceStream::Item& item) = 0;
};

/// Poses in the frame of the trial, or, as TUM, of the first contact.
std::unique_ptr<PoseOutput> make_trial_output(const SlamOptions& options, const LineFormats& formats);

/// Poses in the frame of a map, and what `touches` (or null) shows of them.
std::unique_ptr<PoseOutput> make_map_output(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options,
                                            const LineFormats& formats, LocatedTouches* touches);

}  // namespace gelslam
