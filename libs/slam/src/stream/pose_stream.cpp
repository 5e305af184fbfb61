#include "gelslam/slam/pose_stream.hpp"

#include "gelslam/core/trajectory.hpp"

namespace gelslam {

void PoseStream::write(FrameReport report, const MapSnapshot& map) {
  const TrackedFrame& frame = report.tracked;
  report.scan = scan_;
  if (frame.status != TrackStatus::tracked) report.in_map.reset();
  if (!feed_.has_readers()) return;
  StreamedFrame lines{ndjson_line(report), "",    frame.frame,   frame.time_s,
                      frame.unix_us,       scan_, report.picture};
  // One frame for all poses: that of the first contact.
  if (report.in_map && (map.nodes.empty() || report.in_map->component == map.nodes.front().component))
    lines.tum = tum_line(stamp_s(frame.unix_us, frame.time_s), report.in_map->map_T_frame.pose);
  feed_.write(std::move(lines));
}

void PoseStream::start_scan() {
  ++scan_;
  feed_.set_map(nullptr, scan_);
}

}  // namespace gelslam
