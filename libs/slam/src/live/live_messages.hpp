#pragma once

#include <functional>
#include <memory>
#include <variant>
#include <vector>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/store.hpp"
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
struct SaveNow {};

using TrackerMessage = std::variant<SurfacedFrame, BreakTrial, UndoTrial, SaveNow>;

struct ForgetFromTrial {
  int trial = 0;
};
/// With what had become of the frames when it was asked for: the tracker has gone on when the mapper hears
/// of it.
struct SaveSoFar {
  std::vector<FrameRecord> records;
};

using MapperMessage = std::variant<NewKeyframe, ForgetFromTrial, SaveSoFar>;

/// What is to be written into the session, in this order.
using SessionWork = std::function<void(Store&)>;

using RawQueue = BoundedQueue<RawFramePtr>;
using TrackerQueue = BoundedQueue<TrackerMessage>;
using MapperQueue = BoundedQueue<MapperMessage>;
using SessionQueue = BoundedQueue<SessionWork>;

}  // namespace gelslam::slam::detail
