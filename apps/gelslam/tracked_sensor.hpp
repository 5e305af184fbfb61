#pragma once

#include <memory>
#include <optional>
#include <string>

#include "gelslam/localization/localizer.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/viewer/map_window.hpp"

namespace gelslam {

/// A sensor, and how its frames become surfaces.
struct TrackedSensor {
  LogInput input;
  Config config;
  bool is_camera = false;
  std::shared_ptr<RawFrameSource> frames;  ///< null: the log, as fast as it can be read
};

SurfaceStream open_stream(const TrackedSensor& sensor, StageTimer& timer);

/// Of a frame in which the background is measured.
TrackedFrame background_frame(const SurfaceStream::Item& item);
/// Where the sensor is in the localizer's map.
LocalizedFrame localized(Localizer& localizer, const SurfaceStream::Item& item);

/// The second of two sensors that are fixed to each other.
class SecondSensor {
 public:
  SecondSensor(const TrackedSensor& sensor, std::shared_ptr<const SurfaceMap> map, StageTimer& timer);

  /// Its place in the map, if it knows that. Waits for its first frame at this time or later.
  std::optional<PlaceHypothesis> at(double time_s);
  const LocatedTouch& newest() const { return newest_; }
  std::vector<std::string> warnings() const { return stream_.warnings(); }

 private:
  std::optional<SurfaceStream::Item> next();

  SurfaceStream stream_;
  Localizer localizer_;
  LocalizedFrame before_;
  LocatedTouch newest_;
  bool has_ended_ = false;
};

}  // namespace gelslam
