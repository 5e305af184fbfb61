#include "gelslam/slam/pose_stream.hpp"

#include "gelslam/core/trajectory.hpp"

namespace gelslam {

std::optional<MapPlace> place_of(const FrameRecord& frame, const Pose& trial_T_frame,
                                 const MapSnapshot& map) {
  if (frame.keyframe < 0) return std::nullopt;
  if (const MapSnapshot::Node* node = map.find(frame.keyframe))
    return MapPlace{normalized(node->component_T_keyframe * frame.keyframe_T_frame), node->component};
  const MapSnapshot::Node* newest = map.newest_of(frame.trial);
  if (newest == nullptr) return std::nullopt;
  const Pose newest_T_frame = newest->trial_T_keyframe.inverse() * trial_T_frame;
  return MapPlace{normalized(newest->component_T_keyframe * newest_T_frame), newest->component};
}

std::optional<MapPlace> place_of(const TrackedFrame& frame, const MapSnapshot& map) {
  if (frame.status != TrackStatus::tracked) return std::nullopt;
  return place_of(record_of(frame), frame.trial_T_frame, map);
}

void PoseStream::write(FrameReport report, const MapSnapshot& map) {
  const TrackedFrame& frame = report.tracked;
  report.scan = scan_;
  report.covariance = drift_.add(frame);
  if (!feed_.has_readers()) return;
  report.place = place_of(frame, map);
  StreamedFrame lines{ndjson_line(report), "",    frame.frame,   frame.time_s,
                      frame.unix_us,       scan_, report.picture};
  // One frame for all poses: that of the first contact.
  if (report.place && report.place->component == map.nodes.front().component)
    lines.tum = tum_line(stamp_s(frame.unix_us, frame.time_s), report.place->map_T_frame);
  feed_.write(std::move(lines));
}

void PoseStream::start_scan() {
  ++scan_;
  drift_ = TrialDrift(gradient_scale_sigma_);
  feed_.set_map(nullptr, scan_);
}

}  // namespace gelslam
