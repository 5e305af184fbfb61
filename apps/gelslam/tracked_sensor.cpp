#include "tracked_sensor.hpp"

#include <functional>
#include <iostream>
#include <limits>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/localization/rig_place.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "reports.hpp"

namespace gelslam {

SurfaceStream open_stream(const TrackedSensor& sensor, StageTimer& timer) {
  if (!sensor.frames) return {sensor.input, sensor.config, timer};
  std::function<void(const std::string&)> ask;
  if (sensor.is_camera) ask = [](const std::string& request) { std::cerr << "gelslam: " << request << "\n"; };
  const std::string name = sensor.is_camera ? "camera" : sensor.input.log.string();
  return {decode_frames(sensor.frames, name, sensor.config.sensor), sensor.input, sensor.config, timer, ask};
}

TrackedFrame background_frame(const SurfaceStream::Item& item) {
  TrackedFrame frame;
  frame.frame = item.frame;
  frame.time_s = item.time_s;
  frame.status = TrackStatus::background;
  return frame;
}

LocalizedFrame localized(Localizer& localizer, const SurfaceStream::Item& item) {
  if (item.surface) return localizer.process(item.frame, item.time_s, item.surface);
  LocalizedFrame frame;
  frame.tracked = background_frame(item);
  return frame;
}

SecondSensor::SecondSensor(const TrackedSensor& sensor, std::shared_ptr<const SurfaceMap> map,
                           StageTimer& timer)
    : stream_(open_stream(sensor, timer)), localizer_(std::move(map), sensor.config.slam) {
  for (const std::string& doubt : stream_.background_doubts()) warn("second sensor: " + doubt);
  newest_.place.tracked.time_s = -std::numeric_limits<double>::infinity();
}

std::optional<PlaceHypothesis> SecondSensor::at(double time_s) {
  while (!has_ended_ && newest_.place.tracked.time_s < time_s) {
    const std::optional<SurfaceStream::Item> item = next();
    has_ended_ = !item;
    if (!item) break;
    before_ = std::move(newest_.place);
    newest_ = {item->picture, item->surface, localized(localizer_, *item)};
  }
  return has_ended_ ? std::nullopt : place_between(before_, newest_.place, time_s);
}

/// The first sensor goes on when this one is lost.
std::optional<SurfaceStream::Item> SecondSensor::next() {
  try {
    return stream_.next();
  } catch (const Error& error) {
    warn("second sensor: " + std::string(error.what()));
    return std::nullopt;
  }
}

}  // namespace gelslam
