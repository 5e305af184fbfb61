#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/surface/surface.hpp"
#include "live/live_board.hpp"

namespace gelslam::slam::detail {

using RawFramePtr = std::shared_ptr<const RawFrame>;

/// From the surface stage to the tracker. Without a surface it is a background frame.
struct SurfacedFrame {
  TactileImage image;
  SurfacePtr surface;
  LiveClock::time_point arrived;
};

// What a person asks for travels with the frames, so that it happens between two of them.
struct BreakTrial {};
struct UndoTrial {};
struct SaveNow {
  std::uintmax_t scan_bytes = 0;  // the session's record by then
};

using TrackerMessage = std::variant<SurfacedFrame, BreakTrial, UndoTrial, SaveNow>;

struct ForgetFromTrial {
  int trial = 0;
};
/// With what had become of the frames when it was asked for: the tracker has gone on when the mapper hears
/// of it.
struct SaveSoFar {
  std::vector<FrameRecord> records;
  std::uintmax_t scan_bytes = 0;
};

using MapperMessage = std::variant<NewKeyframe, ForgetFromTrial, SaveSoFar>;

using RawQueue = BoundedQueue<RawFramePtr>;
using TrackerQueue = BoundedQueue<TrackerMessage>;
using MapperQueue = BoundedQueue<MapperMessage>;

}  // namespace gelslam::slam::detail
