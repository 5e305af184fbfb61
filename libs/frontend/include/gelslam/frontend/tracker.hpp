#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/frontend/turning_points.hpp"
#include "gelslam/registration/registrar.hpp"

namespace gelslam {

struct TrackerOptions {
  int contact_threshold_px = 500;  ///< fewer contact pixels are no contact
  /// A new keyframe is made when the current one shares less than this with what the frame shows: a first
  /// touch is small, and a roll leaves the keyframe behind long before tracking breaks.
  double keyframe_min_shared = 0.55;
  /// A frame at which the motion turns back becomes a keyframe, too, if it alone shows so much of its
  /// contact.
  double keyframe_min_unseen = 0.05;
  /// When registration fails from where the sensor is expected, or the step it finds is an unusual one, look
  /// for the one place where the two textures agree; if there are several, the frame is lost.
  bool search_far = true;
  /// A frame that fits nothing may be a torn picture: until this long after the last tracked frame the trial
  /// goes on if a later frame fits it again. A new one begins with the first two frames that fit each other.
  double patience_s = 0.2;
  NormalFlowOptions registration;
};

/// `undone`: tracked, but a person took the trial back.
enum class TrackStatus { background, no_contact, tracked, lost, undone };

/// "background", "no_contact", "tracked", "lost", "undone": as in the NDJSON stream.
std::string_view name(TrackStatus status);

/// What is known of a frame as soon as it was seen.
struct TrackedFrame {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  int trial = -1;  ///< counts unbroken stretches from 0; -1 without contact, and for a lost frame that
                   ///< begins none
  std::shared_ptr<const Keyframe> keyframe;  ///< what keyframe_T_frame refers to; null where trial is -1
  Pose keyframe_T_frame = Pose::Identity();
  Pose trial_T_frame = Pose::Identity();  ///< sensor pose in the first frame of the trial
  RegistrationResult registration;        ///< of the decisive attempt; why a frame was lost
  /// The keyframes made while this frame was tracked, in order of ids: this frame, the one before, or one
  /// some time ago that alone showed a part of the object before the motion turned back (no frame refers to
  /// that).
  std::vector<NewKeyframe> new_keyframes;
};

/// Registers each frame to the current keyframe and decides on keyframes and trials (Huang et al., T-RO 2026,
/// §IV; the retries and the early keyframes are our own). Deterministic; frames must come in order.
class Tracker {
 public:
  /// Registers with NormalFlow and options.registration, or with another method.
  explicit Tracker(const TrackerOptions& options)
      : Tracker(options, make_normal_flow(options.registration)) {}
  Tracker(const TrackerOptions& options, std::shared_ptr<const Registrar> registrar)
      : options_(options), registrar_(std::move(registrar)), turning_points_(options.keyframe_min_unseen) {}

  TrackedFrame track(std::int64_t frame, double time_s, SurfacePtr surface);

  /// The next frame in contact starts a new trial: frames were left out on purpose, and the object may have
  /// moved.
  void break_trial();

 private:
  struct Seen {
    std::int64_t frame = 0;
    double time_s = 0;
    SurfacePtr surface;
  };
  struct Previous : Seen {    // the last tracked frame
    KeyframeLink link;        // to the current keyframe
    double residual_rad = 0;  // of its normals, when it was registered
  };

  /// Lost only because it fits at several places.
  struct Doubtful {
    double time_s = 0;
    Pose keyframe_T_frame = Pose::Identity();  // the expected one of them
  };

  RegistrationResult register_to(const PreparedReference& reference, const Pose& reference_T_previous,
                                 const Surface& surface) const;
  bool is_sound(const RegistrationResult& registration, double time_s) const;
  bool is_usual(const RegistrationResult& registration, const Pose& reference_T_previous,
                double time_s) const;
  RegistrationResult go_on(const Surface& surface, double time_s);
  RegistrationResult place_on(const PreparedReference& reference, const Pose& reference_T_previous,
                              const Surface& surface, const RegistrationResult& registration,
                              double time_s) const;
  std::shared_ptr<const Keyframe> make_keyframe(std::int64_t frame, const PreparedReference& reference,
                                                SurfacePtr surface);
  RegistrationResult follow(TrackedFrame& result, const Surface& surface);
  void lose(TrackedFrame& result, SurfacePtr surface);
  void begin_trial(TrackedFrame& result, const Seen& first,
                   std::shared_ptr<const PreparedReference> reference);
  void switch_keyframe(TrackedFrame& result, const TurningPoints::Touch& touch,
                       std::shared_ptr<const PreparedReference> reference);
  void hand_out_turning_point(TrackedFrame& result, const std::optional<TurningPoints::Touch>& touch);
  void accept(TrackedFrame& result, SurfacePtr surface, const RegistrationResult& registration);
  bool keyframe_is_outgrown(const RegistrationResult& registration, const Surface& surface) const;

  TrackerOptions options_;
  std::shared_ptr<const Registrar> registrar_;
  int next_keyframe_id_ = 0;
  int trial_ = -1;
  bool in_trial_ = false;
  std::shared_ptr<const Keyframe> keyframe_;
  std::shared_ptr<const PreparedReference> reference_;  ///< the keyframe's
  Pose trial_T_keyframe_ = Pose::Identity();
  TurningPoints turning_points_;
  std::optional<Previous> previous_;
  std::optional<Seen> unplaced_;       ///< the last frame, where that was lost and began no trial
  std::optional<Doubtful> doubtful_;   ///< the last frame, where that was
  Pose last_step_ = Pose::Identity();  ///< previous-but-one frame -> previous frame: previous2_T_previous
};

}  // namespace gelslam
