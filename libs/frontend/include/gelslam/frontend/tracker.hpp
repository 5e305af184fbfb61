#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "gelslam/frontend/hand_motion.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/frontend/turning_points.hpp"
#include "gelslam/registration/registrar.hpp"
#include "gelslam/registration/verification.hpp"

namespace gelslam {

struct TrackerOptions {
  /// A contact of this area begins a trial. Within a trial, a frame with less than a quarter of it has no
  /// contact.
  double min_contact_mm2 = 2;
  /// The keyframe is replaced when it shows less than this fraction of the current frame's contact. The value
  /// is high because a first touch is small, and a rolling object leaves the keyframe's contact long before
  /// registration fails.
  double keyframe_min_shared = 0.55;
  /// A frame at which the motion turns back is kept as a patch if at least this fraction of its contact is in
  /// no keyframe.
  double keyframe_min_unseen = 0.03;
  /// If registration fails from the predicted pose, search for a pose at which the two textures agree. If
  /// several poses agree about equally well, the frame counts as lost.
  bool relocalize = true;
  /// A frame that cannot be registered may be a damaged image, and a contact may be interrupted for a moment.
  /// For this long after the last tracked frame, the trial continues as soon as a later frame can be
  /// registered again; after that, the next contact begins a new trial.
  double patience_s = 0.2;
};

enum class TrackStatus { background, no_contact, tracked, lost };

/// Returns "background", "no_contact", "tracked" or "lost", as in the NDJSON stream.
std::string_view name(TrackStatus status);

/// Result of tracking one frame.
struct TrackedFrame {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  /// Number of the trial, counted from 0. It is -1 for a frame without contact, and for a lost frame that
  /// does not begin a new trial.
  int trial = -1;
  /// The keyframe to which keyframe_T_frame refers. It is null where trial is -1.
  std::shared_ptr<const Keyframe> keyframe{};
  Pose keyframe_T_frame = Pose::Identity();
  Pose trial_T_frame = Pose::Identity();  ///< pose in the sensor frame of the trial's first frame
  /// The registration that decided the status. For a lost frame it tells why.
  RegistrationResult registration{};
  /// Keyframes that were created when this frame was processed, in ascending order of ids. Each is this
  /// frame, the last tracked frame before it, or (as a patch) an earlier frame at a turning point of the
  /// motion.
  std::vector<NewKeyframe> new_keyframes{};
  std::int64_t unix_us = 0;  ///< the value that was given to track()
};

/// Tracks the sensor on the object, frame by frame (Huang et al., T-RO 2026, §IV). Contact begins a trial,
/// whose first frame is a keyframe; the trial ends when no frame could be registered for
/// TrackerOptions::patience_s. In between, each frame with contact goes through these steps:
///  1. Prediction at constant velocity (HandMotion). It is the prior of the registration.
///  2. Registration to the keyframe. If it fails, the frame is registered to the last tracked frame, which
///     becomes a keyframe if that succeeds.
///  3. Relocalization if both fail: a search for the pose at which the textures agree, first on the keyframe
///     and then on the last tracked frame. If there is no such pose, or more than one, the frame is lost.
///  4. Correction: prediction and registration are combined into the new state.
///  5. A keyframe that shares too little of the frame's contact is replaced by the frame. A frame at which
///     the motion turns back is kept as a patch of the mesh (TurningPoints). If the previous frame does not
///     confirm the contact, the image may be damaged, and the frame becomes neither a keyframe nor a patch.
/// Prediction, relocalization, turning points and the continuation of a trial after lost frames or after an
/// interrupted contact are not in the paper. Deterministic; frames must be passed in order.
class Tracker {
 public:
  /// Registers with NormalFlow.
  explicit Tracker(const TrackerOptions& options, const NormalFlowOptions& registration = {},
                   const VerificationOptions& verification = {})
      : Tracker(options, make_normal_flow(registration), registration, verification) {}
  /// Registers with the given method. NormalFlow is still used for relocalization and to prepare keyframes
  /// for loop closure.
  Tracker(const TrackerOptions& options, Registrar registrar, const NormalFlowOptions& registration = {},
          const VerificationOptions& verification = {});

  /// Tracks one frame. `surface` is null for a background frame. `unix_us`: see TactileImage::unix_us.
  TrackedFrame track(std::int64_t frame, double time_s, const SurfacePtr& surface, std::int64_t unix_us = 0);

  /// Ends the trial, because the log ends, or because frames were skipped and the object may have moved. The
  /// next frame with contact begins a new trial. Returns the last turning point as a patch, if it shows
  /// surface that is in no keyframe yet.
  std::vector<NewKeyframe> end_trial();

  /// Continues the numbering of a previous scan, whose last keyframe and last trial had the given numbers.
  /// Must be called before the first frame.
  void continue_after(int keyframe_id, int trial);

 private:
  struct Tracked : TurningPoints::Touch {
    double time_s = 0;
    MotionState state;  ///< State relative to the current keyframe.
  };
  struct Attempt {
    RegistrationResult registration;
    ExpectedMotion expected;
  };

  Attempt register_to(const PreparedReference& reference, const MotionState& before, double time_s,
                      const Surface& surface) const;
  Attempt relocalize_on(const PreparedReference& reference, const Surface& surface,
                        const Attempt& failed) const;
  Attempt track_with_fallback(TrackedFrame& result, const Surface& surface);
  double shared_with_keyframe(const RegistrationResult& registration, const Surface& surface) const;
  void accept(TrackedFrame& result, const Attempt& attempt, const SurfacePtr& surface);
  void begin_trial(TrackedFrame& result, const SurfacePtr& surface);
  NewKeyframe make_keyframe(const TurningPoints::Touch& touch, bool is_patch = false);
  void switch_keyframe(TrackedFrame& result, const TurningPoints::Touch& touch, PreparedReference reference);

  TrackerOptions options_;
  NormalFlowOptions normal_flow_;
  VerificationOptions verification_;
  Registrar registrar_;
  int next_keyframe_id_ = 0;
  int trial_ = -1;
  bool in_trial_ = false;
  std::shared_ptr<const Keyframe> keyframe_;
  PreparedReference reference_;  ///< Prepared reference of the keyframe.
  TurningPoints turning_points_;
  Tracked previous_;  ///< the last tracked frame of the trial
  HandMotion hand_;
};

}  // namespace gelslam
