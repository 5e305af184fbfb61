#include <array>
#include <nlohmann/json.hpp>

#include "gelslam/core/se3.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/slam/pose_stream.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

/// What is uncertain about a tracked frame: the degenerate directions, and how far its pose may be off.
std::string pose_warning(const TrackedFrame& frame, const Vector6d& sigma) {
  const std::array<bool, 6>& observable = frame.registration.observable;
  Vector6d of_observable = sigma;
  for (std::size_t axis = 0; axis < observable.size(); ++axis)
    if (!observable[axis]) of_observable[static_cast<int>(axis)] = 0.0;  // said already
  std::string text = describe_observability(observable);
  append_sentence(text, describe_drift(of_observable));
  return text;
}

std::string reason(const TrackedFrame& frame, const std::optional<Matrix6d>& covariance) {
  if (frame.status == TrackStatus::background)
    return "the bare gel; contact is detected by comparing with it";
  if (frame.status == TrackStatus::no_contact) return "nothing touches the sensor";
  if (frame.status == TrackStatus::lost) return std::string(describe(frame.registration.status));
  return covariance ? pose_warning(frame, sigma_of(*covariance)) : "";
}

Json three_numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::optional<Matrix6d> covariance_of(const std::optional<MapPlace>& place) {
  return place ? std::optional(place->map_T_frame.covariance) : std::nullopt;
}

Json si_covariance(const std::optional<Matrix6d>& covariance) {
  if (!covariance) return nullptr;
  const Matrix6d numbers = translation_first(*covariance, 1e-3);  // symmetric: its rows are its columns
  return std::vector<double>(numbers.data(), numbers.data() + numbers.size());
}

Json contact_of(const Surface* surface) {
  if (surface == nullptr) return nullptr;
  const double pitch_mm = surface->pixel_pitch_mm;
  Json contact = {{"area_mm2", surface->contact_pixels * pitch_mm * pitch_mm}, {"center_mm", nullptr}};
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

void add_sigma(Json& json, const std::optional<Matrix6d>& covariance) {
  json["sigma_mm"] = nullptr;
  json["sigma_deg"] = nullptr;
  if (!covariance) return;
  const Vector6d sigma = sigma_of(*covariance);
  json["sigma_mm"] = three_numbers(sigma.head<3>());
  json["sigma_deg"] = three_numbers(kDegreesPerRadian * sigma.tail<3>());
}

Json unix_s(std::int64_t unix_us) { return or_null(unix_us != 0, stamp_s(unix_us, 0)); }

Json frame_json(const FrameReport& report) {
  const TrackedFrame& frame = report.tracked;
  const bool tracked = frame.status == TrackStatus::tracked;
  const std::optional<Matrix6d> covariance = covariance_of(report.in_trial);
  Json json = {
      {"type", "frame"},
      {"frame", frame.frame},
      {"time_s", frame.time_s},
      {"time_unix_s", unix_s(frame.unix_us)},
      {"scan", report.scan},
      {"status", name(frame.status)},
      {"reason", reason(frame, covariance)},
      {"trial", or_null(tracked, frame.trial)},
      {"keyframe", tracked ? Json(frame.keyframe->id) : Json(nullptr)},
      {"new_keyframes", Json::array()},
      {"pose", or_null(tracked, row_major_meters(frame.trial_T_frame))},
      {"covariance", si_covariance(covariance)},
      {"map_pose", report.in_map ? Json(row_major_meters(report.in_map->map_T_frame.pose)) : Json(nullptr)},
      {"map_covariance", si_covariance(covariance_of(report.in_map))},
      {"component", report.in_map ? Json(report.in_map->component) : Json(nullptr)},
      {"observable", Json::array()},
      {"contact", contact_of(report.surface)},
      {"scr", frame.registration.scr},
      {"ccs", frame.registration.ccs}};
  for (const NewKeyframe& added : frame.new_keyframes) json["new_keyframes"].push_back(added.keyframe->id);
  for (const bool axis : frame.registration.observable) json["observable"].push_back(tracked && axis ? 1 : 0);
  add_sigma(json, covariance);
  return json;
}

std::string ndjson_line(const FrameReport& report) { return frame_json(report).dump() + "\n"; }

}  // namespace gelslam
