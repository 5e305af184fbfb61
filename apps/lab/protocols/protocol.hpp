#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/registration/registrar.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "protocols/trials.hpp"

namespace gelslam {

enum class Protocol {
  /// Every frame is registered to the first one in contact, starting from the last estimate (Huang et al.,
  /// RA-L 2024).
  frame0,
  keyframes,  ///< The Tracker, with keyframes, relocalization and acceptance tests.
};

/// Estimate of a method for one frame. Poses are relative to the first frame in contact with a known true
/// pose.
struct FrameEstimate {
  std::int64_t frame = 0;
  /// False if the method found no pose, or rejects it. With `frame0` a rejected pose is evaluated anyway, and
  /// a frame without any pose keeps the last one. With `keyframes` a lost frame keeps the last pose, from
  /// which tracking goes on.
  bool tracked = false;
  Pose first_T_frame = Pose::Identity();
  Pose true_first_T_frame = Pose::Identity();
  /// Processor time of this thread, for a registration (frame0) or a tracker step (keyframes).
  double cpu_ms = 0;
};

/// Runs one method on one trial, frame by frame.
class MethodRun {
 public:
  MethodRun(Registrar registrar, Protocol protocol, const SlamOptions& options);

  /// Processes the next frame. Frames before the first contact have no estimate. Frames without a true pose
  /// have none either, but the method processes them.
  void add(const TrialFrame& frame);
  const std::vector<FrameEstimate>& estimates() const { return estimates_; }

 private:
  struct Answer {
    bool tracked = false;
    double cpu_ms = 0;
  };
  Answer against_first(const TrialFrame& frame);
  Answer with_tracker(const TrialFrame& frame);

  Registrar registrar_;
  Protocol protocol_;
  SlamOptions options_;
  std::optional<Pose> first_T_start_;  ///< Empty before the first contact.
  Pose first_T_last_ = Pose::Identity();
  std::optional<PreparedReference> reference_;  ///< Prepared from the first frame.
  Tracker tracker_;
  int trial_ = -1;
  Pose first_T_trial_ = Pose::Identity();
  std::vector<FrameEstimate> estimates_;
};

}  // namespace gelslam
