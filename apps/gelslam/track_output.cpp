#include "track_output.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "gelslam/core/trajectory.hpp"
#include "gelslam/slam/pose_stream.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

Json hypothesis_json(const PlaceHypothesis& hypothesis) {
  Json json = {{"probability", hypothesis.probability},
               {"map_pose", row_major_meters(hypothesis.map_T_sensor.pose)}};
  add_sigma(json, hypothesis.map_T_sensor.covariance);
  return json;
}

/// As frame_json(), with what localization knows.
Json map_json(const LocalizedFrame& frame, const Surface* surface, const std::optional<MapPlace>& in_trial) {
  const bool localized = frame.status == PlaceStatus::localized;
  FrameReport report{frame.tracked, surface, in_trial};
  if (localized) report.in_map = MapPlace{frame.hypotheses.front().map_T_sensor};
  Json json = frame_json(report);
  json["status"] = status_name(frame);
  if (frame.tracked.status != TrackStatus::background) json["reason"] = frame.reason;
  json["in_map"] = localized;
  json["hypotheses"] = Json::array();
  for (const PlaceHypothesis& hypothesis : frame.hypotheses)
    json["hypotheses"].push_back(hypothesis_json(hypothesis));
  return json;
}

}  // namespace

PoseOutput trial_output(const SlamOptions& options) {
  const auto tracker = std::make_shared<Tracker>(options.tracker, options.registration, options.verification);
  const auto map = std::make_shared<TrialMap>(options.gradient_scale);
  return [=](const SurfaceStream::Item& item) {
    const TactileImage& image = item.image;
    const TrackedFrame frame = tracker->track(image.index, image.time_s, item.surface, image.unix_us);
    PoseLine line;
    const std::optional<MapPlace> place = map->add(frame);
    line.touch = {record_of(frame), image.bgr, item.surface, "", place};
    if (frame.status == TrackStatus::lost) {
      line.state = "lost";
      line.reason = describe(frame.registration.status);
    }
    line.ndjson = ndjson_line({frame, item.surface.get(), place, place});
    return line;
  };
}

PoseOutput map_output(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options,
                      LocatedTouches* touches) {
  const auto localizer = std::make_shared<Localizer>(std::move(map), options);
  const auto trial_map = std::make_shared<TrialMap>(options.gradient_scale);
  return [=](const SurfaceStream::Item& item) {
    const TactileImage& image = item.image;
    const LocalizedFrame frame = localizer->process(image.index, image.time_s, item.surface, image.unix_us);
    if (touches != nullptr) {
      const auto touch = std::make_shared<const LocatedTouch>(LocatedTouch{image.bgr, item.surface, frame});
      touches->newest = touch;
      if (!frame.hypotheses.empty()) touches->placed = touch;
    }
    PoseLine line;
    line.touch = {record_of(frame.tracked), image.bgr, item.surface};
    if (frame.status == PlaceStatus::localized) {
      line.touch.place = MapPlace{frame.hypotheses.front().map_T_sensor};
      line.tum = tum_line(stamp_s(image.unix_us, image.time_s), line.touch.place->map_T_frame.pose);
      line.state = "localized";
    } else if (line.touch.status == TrackStatus::tracked || line.touch.status == TrackStatus::lost) {
      line.touch.status = TrackStatus::lost;
      line.state = "not in the map";
      line.reason = frame.reason;
    }
    line.ndjson = map_json(frame, item.surface.get(), trial_map->add(frame.tracked)).dump() + "\n";
    return line;
  };
}

}  // namespace gelslam
