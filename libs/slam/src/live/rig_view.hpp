#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/backend/rig.hpp"
#include "gelslam/slam/live_session.hpp"

namespace gelslam::slam::detail {

/// What two live sessions show, by sensor.
struct RigNews {
  std::array<std::shared_ptr<const LiveTouch>, 2> touch;  ///< null before the first frame
  std::array<std::shared_ptr<const MapSnapshot>, 2> map;
};

/// The maps of two sensors that are fixed to each other as one map, while they are scanned: the second one's
/// lies in that of the first as soon as it is known how they are fixed. Until then it is another piece. Good
/// enough to be looked at: what is saved comes from merge_scans().
class RigView {
 public:
  explicit RigView(const std::optional<RigPose>& known);

  /// How they are fixed, which may take tenths of a second. Touches nothing of what follows show(); one
  /// thread calls both.
  void learn(const RigNews& news);
  /// The map and the touch from now on.
  void show(const RigNews& news);
  /// The second sensor's keyframes and trials have numbers from kSecond on.
  const std::shared_ptr<const MapSnapshot>& map() const { return map_; }
  /// The first sensor's, unless only the second one touches.
  const std::shared_ptr<const LiveTouch>& touch() const { return touch_; }
  bool shows_second() const { return shows_second_; }

  static constexpr int kSecond = 1 << 24;

 private:
  void collect(const RigNews& news);
  void find_rig(const RigNews& news);
  bool place_second();
  void join_maps();

  std::optional<Pose> first_T_second_, last_estimate_, first_map_T_second_map_;
  std::vector<RigConstraint> constraints_;  // without covariances
  double constrained_s_ = -1e9;
  std::size_t next_estimate_at_;
  RigNews news_;  // that is shown
  std::shared_ptr<const MapSnapshot> map_ = std::make_shared<MapSnapshot>();
  std::shared_ptr<const LiveTouch> touch_, touch_source_;
  bool shows_second_ = false;
};

}  // namespace gelslam::slam::detail
