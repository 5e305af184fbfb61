#pragma once

#include <string>
#include <vector>

#include "analytic_surface.hpp"
#include "gelslam/slam/live_slam.hpp"

namespace gelslam::test {

struct FakePlace {
  Pose map_T_sensor;
  std::shared_ptr<const Surface> surface;
};

/// A made-up live scan: a bumpy pebble, rolled across a perfect sensor place by place, and what a window asks
/// of it, written down. Everything happens when the test says so; one thread.
class FakeSession : public LiveSession {
 public:
  static constexpr int kMaxPlaces = 8;
  /// `places` touches around the object, each seen for `frames_per_place` frames.
  explicit FakeSession(int places = 8, int frames_per_place = 3);

  void advance(int frames = 1);  ///< tracks on: new frames, keyframes, loops, blocks of the mesh
  void say(LivePhase phase, const std::string& state, TrackStatus track = TrackStatus::tracked,
           const std::string& reason = "");
  void release();  ///< nothing touches any more
  LiveStatus& figures() { return status_; }
  void leave_the_map();  ///< the touch goes on in a piece that no loop joins yet
  void join_the_map();   ///< a loop has joined it

  /// "pause", "go on", "stop": what the window asked for, in order.
  std::vector<std::string> calls;

  bool mapper_is_busy = false;  ///< no map comes

  /// stop() is followed by so many looks at the status until it is finished; none: it stays finishing.
  int looks_until_finished = -1;

  LiveStatus status() const override;
  std::shared_ptr<const FrameReport> touch() const override { return touch_; }
  std::shared_ptr<const MapSnapshot> map() const override { return map_; }
  std::shared_ptr<const MeshFeed> mesh() const override { return mesh_; }
  void set_paused(bool paused) override;
  void stop() override;
  void abort() override { stop(); }
  RunReport wait() override { return {}; }
  BackgroundFrames background_frames() const override { return {}; }

 private:
  void uncover(int place);
  void publish_map(int place);

  int frames_per_place_;
  std::vector<FakePlace> places_;
  std::vector<bool> seen_;  // per triangle of the pebble
  std::int64_t frame_ = 0;
  std::uint64_t version_ = 0;
  mutable LiveStatus status_;
  mutable int looks_ = 0;
  std::shared_ptr<const FrameReport> touch_;
  std::shared_ptr<const MapSnapshot> map_ = std::make_shared<MapSnapshot>();
  std::shared_ptr<MeshFeed> mesh_ = std::make_shared<MeshFeed>();
};

}  // namespace gelslam::test
