#pragma once

#include <map>
#include <memory>
#include <optional>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// Where each trial lies in the frame of the first one, by the first loop that joins them: for a pose stream,
/// which cannot correct later what it has written. A trial that is never recognized has no place.
class TrialPlaces {
 public:
  explicit TrialPlaces(const SlamOptions& options)
      : loop_closer_(options.loop_closure, options.registration, options.verification) {}

  /// Keyframes in order of their ids, as the tracker hands them out.
  void add(const std::shared_ptr<const Keyframe>& keyframe);

  /// Maps a trial's frame into that of trial 0, or nothing.
  std::optional<Pose> first_T_trial(int trial) const;

 private:
  LoopCloser loop_closer_;
  std::map<int, std::shared_ptr<const Keyframe>> keyframes_;
  std::map<int, Pose> first_T_trial_;
};

}  // namespace gelslam
