#include "gelslam/slam/frame_report.hpp"

#include <nlohmann/json.hpp>

#include "gelslam/core/se3.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

/// Describes the uncertainty of a tracked frame: motions that are not observable, and the drift of its pose
/// along the others.
std::string pose_warning(const TrackedFrame& frame, const Vector6d& sigma) {
  const std::array<bool, 6>& observable = frame.registration.observable;
  Vector6d of_observable = sigma;
  // Axes that are not observable are already named.
  for (std::size_t axis = 0; axis < observable.size(); ++axis)
    if (!observable[axis]) of_observable[static_cast<int>(axis)] = 0.0;
  std::string text = describe_observability(observable);
  append_sentence(text, describe_drift(of_observable));
  return text;
}

Json three_numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json pose_json(const MapPlace* place) {
  return place != nullptr ? Json(row_major_meters(place->map_T_frame.pose)) : Json(nullptr);
}

Json covariance_json(const MapPlace* place) {
  if (place == nullptr) return nullptr;
  // The matrix is symmetric, so column-major and row-major order are the same.
  const Matrix6d numbers = translation_first(place->map_T_frame.covariance, 1e-3);
  return std::vector<double>(numbers.data(), numbers.data() + numbers.size());
}

/// Adds the fields `sigma_mm` and `sigma_deg`; null if there is no pose.
void add_sigma(Json& json, const UncertainPose* pose) {
  json["sigma_mm"] = nullptr;
  json["sigma_deg"] = nullptr;
  if (pose == nullptr) return;
  const Vector6d sigma = sigma_of(pose->covariance);
  json["sigma_mm"] = three_numbers(sigma.head<3>());
  json["sigma_deg"] = three_numbers(kDegreesPerRadian * sigma.tail<3>());
}

Json hypothesis_json(const PlaceHypothesis& hypothesis) {
  Json json = {{"probability", hypothesis.probability},
               {"map_pose", row_major_meters(hypothesis.map_T_sensor.pose)}};
  add_sigma(json, &hypothesis.map_T_sensor);
  return json;
}

Json contact_of(const Surface* surface) {
  if (surface == nullptr) return nullptr;
  Json contact = {{"area_mm2", surface->contact_mm2()}, {"center_mm", nullptr}};
  if (surface->contact_pixels == 0) return contact;
  const Eigen::Vector2d center_mm = contact_center_mm(*surface);
  contact["center_mm"] = {center_mm.x(), center_mm.y()};
  return contact;
}

template <class T>
Json or_null(bool known, const T& value) {
  return known ? Json(value) : Json(nullptr);
}

}  // namespace

std::array<double, 16> row_major_meters(const Pose& pose_mm) {
  std::array<double, 16> numbers{};
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      numbers[static_cast<std::size_t>(r * 4 + c)] = pose_mm.matrix()(r, c) * (r < 3 && c == 3 ? 1e-3 : 1.0);
  return numbers;
}

Json unix_s(std::int64_t unix_us) { return or_null(unix_us != 0, stamp_s(unix_us, 0)); }

std::string_view status_name(const FrameReport& report) {
  if (!report.localization || !report.has_contact()) return name(report.tracked.status);
  constexpr std::string_view names[] = {"not in the map", "localized", "ambiguous"};
  return names[static_cast<std::size_t>(report.localization->status)];
}

std::string reason_of(const FrameReport& report) {
  const TrackedFrame& frame = report.tracked;
  if (frame.status == TrackStatus::background)
    return "the bare gel; contact is detected by comparing with it";
  if (report.localization) return report.localization->reason;
  if (frame.status == TrackStatus::no_contact) return "nothing touches the sensor";
  if (frame.status == TrackStatus::lost) return std::string(describe(frame.registration.status));
  return report.in_trial ? pose_warning(frame, sigma_of(report.in_trial->map_T_frame.covariance)) : "";
}

std::string ndjson_line(const FrameReport& report, int scan) {
  const TrackedFrame& frame = report.tracked;
  const bool tracked = frame.status == TrackStatus::tracked;
  const MapPlace* in_trial = report.in_trial ? &*report.in_trial : nullptr;
  const MapPlace* in_map = report.known_place();
  Json json = {{"type", "frame"},
               {"frame", frame.frame},
               {"time_s", frame.time_s},
               {"time_unix_s", unix_s(frame.unix_us)},
               {"scan", scan},
               {"status", status_name(report)},
               {"reason", reason_of(report)},
               {"trial", or_null(tracked, frame.trial)},
               {"keyframe", tracked ? Json(frame.keyframe->id) : Json(nullptr)},
               {"new_keyframes", Json::array()},
               {"pose", or_null(tracked, row_major_meters(frame.trial_T_frame))},
               {"covariance", covariance_json(in_trial)},
               {"map_pose", pose_json(in_map)},
               {"map_covariance", covariance_json(in_map)},
               {"component", in_map != nullptr ? Json(in_map->component) : Json(nullptr)},
               {"observable", Json::array()},
               {"contact", contact_of(report.surface.get())},
               {"scr", frame.registration.scr},
               {"ccs", frame.registration.ccs}};
  for (const NewKeyframe& added : frame.new_keyframes) json["new_keyframes"].push_back(added.keyframe->id);
  for (const bool axis : frame.registration.observable) json["observable"].push_back(tracked && axis ? 1 : 0);
  add_sigma(json, in_trial != nullptr ? &in_trial->map_T_frame : nullptr);
  if (report.localization) {
    json["in_map"] = in_map != nullptr;
    json["hypotheses"] = Json::array();
    for (const PlaceHypothesis& hypothesis : report.localization->hypotheses)
      json["hypotheses"].push_back(hypothesis_json(hypothesis));
  }
  return json.dump() + "\n";
}

std::string tum_line(const FrameReport& report) {
  const MapPlace* place = report.known_place();
  if (place == nullptr) return "";
  return tum_line(stamp_s(report.tracked.unix_us, report.tracked.time_s), place->map_T_frame.pose);
}

}  // namespace gelslam
