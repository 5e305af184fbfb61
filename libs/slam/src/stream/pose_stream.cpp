#include "gelslam/slam/pose_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMapKey = std::numeric_limits<int>::max();  // kept behind the keyframes

/// Every n-th contact pixel in both directions, so that there are about 1000; meters, rounded to 0.01 mm.
Json contact_points(const Surface& surface) {
  constexpr double kPoints = 1000.0;
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(surface.contact_pixels / kPoints))));
  const auto rounded = [](double mm) { return std::round(1e2 * mm) / 1e5; };
  Json points = Json::array();
  for (int v = 0; v < surface.contact.rows; v += step)
    for (int u = 0; u < surface.contact.cols; u += step)
      if (surface.contact(v, u) != 0) {
        const Eigen::Vector3d p = surface.point_mm({u, v});
        points.push_back({rounded(p.x()), rounded(p.y()), rounded(p.z())});
      }
  return points;
}

Json keyframe_json(const Keyframe& keyframe, int scan) {
  return {{"type", "keyframe"},      {"scan", scan},
          {"keyframe", keyframe.id}, {"frame", keyframe.frame},
          {"trial", keyframe.trial}, {"points", contact_points(*keyframe.surface.get())}};
}

Json map_json(const MapSnapshot& map, int scan) {
  Json keyframes = Json::array();
  for (const MapSnapshot::Node& node : map.nodes)
    keyframes.push_back({{"keyframe", node.keyframe},
                         {"component", node.component},
                         {"pose", row_major_meters(node.component_T_keyframe)}});
  return {{"type", "map"},
          {"scan", scan},
          {"version", map.version},
          {"shown_component", map.shown_component},
          {"keyframes", std::move(keyframes)}};
}

std::string image_line(const FrameReport& report) {
  const std::vector<std::uint8_t> jpeg = encode_jpeg(report.picture);
  const Json line = {{"type", "image"},
                     {"frame", report.tracked.frame},
                     {"time_s", report.tracked.time_s},
                     {"time_unix_s", unix_s(report.tracked)},
                     {"arrived_s", report.arrived_s ? Json(*report.arrived_s) : Json(nullptr)},
                     {"scan", report.scan},
                     {"jpeg", base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()})}};
  return line.dump() + "\n";
}

}  // namespace

std::string dropped_notice(StreamFormat format, std::int64_t lines) {
  if (format == StreamFormat::tum) return "# " + std::to_string(lines) + " lines dropped\n";
  return Json{{"type", "dropped"}, {"lines", lines}}.dump() + "\n";
}

std::optional<MapPlace> place_of(const TrackedFrame& frame, const MapSnapshot& map) {
  if (frame.status != TrackStatus::tracked) return std::nullopt;
  if (const MapSnapshot::Node* node = map.find(frame.keyframe->id))
    return MapPlace{normalized(node->component_T_keyframe * frame.keyframe_T_frame), node->component};
  const MapSnapshot::Node* newest = map.newest_of(frame.trial);
  if (newest == nullptr) return std::nullopt;
  const Pose keyframe_T_frame = newest->trial_T_keyframe.inverse() * frame.trial_T_frame;
  return MapPlace{normalized(newest->component_T_keyframe * keyframe_T_frame), newest->component};
}

PoseStream::PoseStream(const Options& options)
    : options_(options),
      server_(options.target,
              [format = options.format](std::int64_t lines) { return dropped_notice(format, lines); }),
      drift_(options.gradient_scale_sigma) {}

void PoseStream::write(FrameReport report, const MapSnapshot& map) {
  const TrackedFrame& frame = report.tracked;
  report.scan = scan_;
  report.covariance = drift_.add(frame);
  report.place = place_of(frame, map);
  if (options_.format == StreamFormat::tum) {
    // One frame for all poses: that of the first contact.
    if (report.place && report.place->component == map.nodes.front().component)
      server_.write(tum_line(stamp_s(frame.unix_us, frame.time_s), report.place->map_T_frame));
    return;
  }
  server_.write(ndjson_line(report));
  if (options_.images && !report.picture.empty()) server_.write(image_line(report));
  for (const NewKeyframe& added : frame.new_keyframes) keep(*added.keyframe);
}

void PoseStream::keep(const Keyframe& keyframe) {
  if (options_.surface && options_.format == StreamFormat::ndjson)
    server_.write_and_keep(keyframe.id, keyframe_json(keyframe, scan_).dump() + "\n");
}

void PoseStream::start_scan() {
  ++scan_;
  drift_ = TrialDrift(options_.gradient_scale_sigma);
  server_.forget_kept();
}

void PoseStream::write_map(const MapSnapshot& map) {
  if (options_.surface && options_.format == StreamFormat::ndjson)
    server_.write_and_keep(kMapKey, map_json(map, scan_).dump() + "\n");
}

}  // namespace gelslam
