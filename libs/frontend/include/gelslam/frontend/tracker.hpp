#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "gelslam/frontend/hand_motion.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/frontend/turning_points.hpp"
#include "gelslam/registration/registrar.hpp"
#include "gelslam/registration/verification.hpp"

namespace gelslam {

struct TrackerOptions {
  int contact_threshold_px = 500;  ///< fewer contact pixels begin no trial; a quarter of it ends one
  /// A keyframe is replaced when it shows less than this share of the frame's contact: a first touch is
  /// small, and a roll leaves the keyframe behind long before tracking breaks.
  double keyframe_min_shared = 0.55;
  /// A frame at which the motion turns back is kept as a patch if it alone shows this share of its contact.
  double keyframe_min_unseen = 0.03;
  /// When registration fails from where the sensor is expected, look for the one place where the two textures
  /// agree. If there are several, the frame is lost.
  bool relocalize = true;
  /// A frame that fits nothing may be a torn picture: until this long after the last tracked frame, the trial
  /// continues if a later frame fits it again. A new trial begins after it.
  double patience_s = 0.2;
};

enum class TrackStatus { background, no_contact, tracked, lost };

/// Returns "background", "no_contact", "tracked" or "lost", as in the NDJSON stream.
std::string_view name(TrackStatus status);

/// What is known of a frame right after it was registered.
struct TrackedFrame {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  int trial = -1;  ///< counts unbroken stretches from 0; -1 without contact, and for a lost frame that
                   ///< begins none
  /// What keyframe_T_frame refers to; null where trial is -1.
  std::shared_ptr<const Keyframe> keyframe{};
  Pose keyframe_T_frame = Pose::Identity();
  Pose trial_T_frame = Pose::Identity();  ///< sensor pose in the first frame of the trial
  RegistrationResult registration{};      ///< of the decisive attempt; why a frame was lost
  /// The keyframes made while this frame was tracked, in order of ids: this frame, the one before, or a
  /// patch, some time ago, that alone showed a part of the object before the motion turned back.
  std::vector<NewKeyframe> new_keyframes{};
  std::int64_t unix_us = 0;  ///< as given to track()
};

/// Tracks the sensor on the object, frame by frame (Huang et al., T-RO 2026, §IV). Contact begins a trial
/// with a keyframe, and a quarter of that contact ends it. In between, each frame goes through these steps:
///  1. Prediction: the hand goes on at constant velocity (HandMotion). This is the prior of the registration.
///  2. Registration to the keyframe. If it fails, the frame is registered to the last tracked frame, which
///     becomes a keyframe if that succeeds.
///  3. Relocalization, if both fail: the one place on either where the textures agree. If there are several,
///     the frame is lost.
///  4. Correction: the hand's state follows from prediction and registration.
///  5. A keyframe that shares too little of the frame's contact is replaced by the frame. A frame at which
///     the motion turns back is kept as a patch of the mesh (TurningPoints). Contact that the frame before
///     does not confirm may belong to a damaged picture: it makes neither.
/// A lost frame may be a torn picture, so the trial waits for a frame that fits again. When its patience is
/// over, the next frame begins a new trial. Prediction, relocalization and turning points are our own.
/// Deterministic; frames must come in order.
class Tracker {
 public:
  /// Registers with NormalFlow.
  explicit Tracker(const TrackerOptions& options, const NormalFlowOptions& registration = {},
                   const VerificationOptions& verification = {})
      : Tracker(options, make_normal_flow(registration), registration, verification) {}
  /// Registers with another method. NormalFlow finds lost places and prepares keyframes for loop closure.
  Tracker(const TrackerOptions& options, Registrar registrar, const NormalFlowOptions& registration = {},
          const VerificationOptions& verification = {});

  /// `surface` is null for a frame of the background. `unix_us`: TactileImage::unix_us.
  TrackedFrame track(std::int64_t frame, double time_s, const SurfacePtr& surface, std::int64_t unix_us = 0);

  /// Says that the log ends, or that frames were left out on purpose and the object may have moved: the next
  /// frame in contact starts a new trial. Returns what was touched last, if no keyframe shows it yet.
  std::vector<NewKeyframe> end_trial();

  /// To be called before the first frame, where a scan is continued whose last keyframe and trial had these
  /// numbers.
  void continue_after(int keyframe_id, int trial);

 private:
  struct Tracked : TurningPoints::Touch {
    double time_s = 0;
    MotionState state;  ///< in the current keyframe
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
  PreparedReference reference_;  ///< the keyframe's
  TurningPoints turning_points_;
  Tracked previous_;  ///< the last tracked frame of the trial
  HandMotion hand_;
};

}  // namespace gelslam
