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
  frame0,     ///< every frame against the first in contact, from the last estimate (Huang et al., RA-L 2024)
  keyframes,  ///< the Tracker, with keyframes, retries and gates
};

/// What a method said about one frame. Poses are relative to the first frame in contact whose truth is known.
struct FrameEstimate {
  std::int64_t frame = 0;
  /// False where the method found no pose or calls it no match. What it found is judged all the same under
  /// frame0; a frame without any pose keeps the last one. Under keyframes, a lost frame keeps the last one,
  /// and tracking goes on from there.
  bool tracked = false;
  Pose first_T_frame = Pose::Identity();
  Pose true_first_T_frame = Pose::Identity();
  /// processor time of this thread: of a registration (frame0) or a tracker step (keyframes)
  double cpu_ms = 0;
};

/// One method on one trial, frame after frame.
class MethodRun {
 public:
  MethodRun(Registrar registrar, Protocol protocol, const SlamOptions& options);

  /// Frames in order. Those before the first contact say nothing, and so do those without a true pose, which
  /// the method sees all the same.
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
  std::optional<Pose> first_T_start_;  ///< none before the first contact
  Pose first_T_last_ = Pose::Identity();
  std::optional<PreparedReference> reference_;  ///< of the first frame
  Tracker tracker_;
  int trial_ = -1;
  Pose first_T_trial_ = Pose::Identity();
  std::vector<FrameEstimate> estimates_;
};

}  // namespace gelslam
