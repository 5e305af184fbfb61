// Tracks the sensor on the object frame by frame (Huang, Mirzaee, Kaess, Yuan, GelSLAM, T-RO 2026, section
// IV).
//
// HandMotion predicts the next pose and its covariance, from which the frame is registered to the keyframe.
// If that fails, it is registered to the last tracked frame, which then becomes a keyframe. If that fails,
// too, relocalize() searches for the one pose at which the textures agree, on the keyframe and on the last
// tracked frame. A frame replaces the keyframe when the keyframe shows too little of its contact.
// TurningPoints keeps frames that alone show a part of the object as patches.
//
// A frame that cannot be registered is lost, and its pose is not extrapolated. It may be a damaged image, or
// the contact may be interrupted for a moment, when the object hits the gel or is hardly pressed. Therefore
// the trial lasts for patience_s after the last tracked frame, with contact or without. The first contact
// after that time begins a new trial. A frame becomes a keyframe only if the previous frame shows the same
// contact, except for the first frame of a trial and for the last tracked frame in the fallback above. The
// errors of a chain of keyframes accumulate here and are corrected later by loops.

#include "gelslam/frontend/tracker.hpp"

#include <utility>

#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/registration/relocalization.hpp"
#include "gelslam/surface/contact_overlap.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

// The size of the contact varies as an object rolls over its bumps. Therefore a trial only ends when the
// contact is smaller than this fraction of the contact that begins a trial. Above that, the registration
// decides whether the contact suffices.
constexpr double kShrunkContact = 0.25;

}  // namespace

std::string_view name(TrackStatus status) {
  constexpr std::string_view names[] = {"background", "no_contact", "tracked", "lost"};
  return names[static_cast<std::size_t>(status)];
}

PoseGraphEdge odometry_edge(int from, int to, const RegistrationResult& registration) {
  const Pose& to_T_from = registration.target_T_reference;
  return {from,
          to,
          to_T_from.inverse(),
          symmetric(information_of_inverse(registration.information, to_T_from)),
          EdgeKind::odometry,
          to_T_from * registration.shared_center_mm};
}

Tracker::Tracker(const TrackerOptions& options, Registrar registrar, const NormalFlowOptions& registration,
                 const VerificationOptions& verification)
    : options_(options),
      normal_flow_(registration),
      verification_(verification),
      registrar_(std::move(registrar)),
      turning_points_(options.keyframe_min_unseen) {}

void Tracker::continue_after(int keyframe_id, int trial) {
  next_keyframe_id_ = keyframe_id + 1;
  trial_ = trial;
}

TrackedFrame Tracker::track(std::int64_t frame, double time_s, const SurfacePtr& surface,
                            std::int64_t unix_us) {
  TrackedFrame result{.frame = frame, .time_s = time_s, .unix_us = unix_us};
  if (!surface) {
    result.status = TrackStatus::background;
    return result;
  }
  const bool touches = surface->contact_mm2() >= (in_trial_ ? kShrunkContact : 1) * options_.min_contact_mm2;
  if (!in_trial_) {
    if (!touches) return result;
    result.status = TrackStatus::tracked;
    begin_trial(result, surface);
    // The frame is registered to itself, which tells along which directions this surface determines a pose.
    result.registration = reference_.register_to(*surface, Pose::Identity());
    return result;
  }
  if (touches) {
    const Attempt attempt = track_with_fallback(result, *surface);
    result.registration = attempt.registration;
    if (attempt.registration.ok()) {
      accept(result, attempt, surface);
      return result;
    }
    result.status = TrackStatus::lost;
  }
  previous_.state.velocity.setZero();  // Nothing tells whether the motion has gone on.
  if (time_s - previous_.time_s <= options_.patience_s) return result;
  if (touches)
    begin_trial(result, surface);
  else
    result.new_keyframes = end_trial();
  return result;
}

/// Registers the frame to a reference, with the predicted motion of the hand as the prior.
Tracker::Attempt Tracker::register_to(const PreparedReference& reference, const MotionState& before,
                                      double time_s, const Surface& surface) const {
  const ExpectedMotion expected = hand_.expect(before, time_s - previous_.time_s);
  return {reference.register_to(surface, expected.prior()), expected};
}

/// Searches for the only pose at which the frame fits the reference, after the attempt `failed`. The result
/// is not ok() when there is no such pose, or more than one.
Tracker::Attempt Tracker::relocalize_on(const PreparedReference& reference, const Surface& surface,
                                        const Attempt& failed) const {
  if (!options_.relocalize) return failed;
  const RegistrationResult candidate =
      relocalize(*reference.samples, surface, failed.expected.reference_T_frame.pose.inverse(),
                 failed.registration, normal_flow_, verification_);
  if (!candidate.ok()) return {candidate, failed.expected};
  // The tracker's own registration method starts from that pose and decides.
  return {reference.register_to(surface, candidate.target_T_reference), failed.expected};
}

/// Registers the frame to the keyframe. If that fails, registers it to the last tracked frame, which becomes
/// a keyframe if that succeeds. If that fails, too, relocalizes it on the keyframe and then on the last
/// tracked frame.
Tracker::Attempt Tracker::track_with_fallback(TrackedFrame& result, const Surface& surface) {
  const Attempt on_keyframe = register_to(reference_, previous_.state, result.time_s, surface);
  if (on_keyframe.registration.ok()) return on_keyframe;
  if (previous_.frame == keyframe_->frame) return relocalize_on(reference_, surface, on_keyframe);

  PreparedReference previous = registrar_(previous_.surface);
  Attempt on_previous = register_to(previous, previous_.state.in_itself(), result.time_s, surface);
  if (!on_previous.registration.ok()) {
    const Attempt candidate = relocalize_on(reference_, surface, on_keyframe);
    if (candidate.registration.ok()) return candidate;
    on_previous = relocalize_on(previous, surface, on_previous);
    if (!on_previous.registration.ok()) return candidate;
  }
  switch_keyframe(result, previous_, std::move(previous));
  return on_previous;
}

/// Returns the fraction of the contact of `surface` that the keyframe shows, estimated from the samples of
/// the registration.
double Tracker::shared_with_keyframe(const RegistrationResult& registration, const Surface& surface) const {
  const double share = static_cast<double>(registration.shared_samples) / reference_.samples->sample_count();
  return share * reference_.samples->surface().contact_pixels / surface.contact_pixels;
}

void Tracker::accept(TrackedFrame& result, const Attempt& attempt, const SurfacePtr& surface) {
  const RegistrationResult& registration = result.registration;
  PoseGraphEdge edge = odometry_edge(keyframe_->id, -1, registration);
  const Pose keyframe_T_frame = edge.from_T_to;
  const double confirmed = shown_share(coarse_contact_points_mm(*surface), *previous_.surface,
                                       previous_.state.reference_T_frame.pose.inverse() * keyframe_T_frame);
  previous_.state = hand_.correct(attempt.expected, registration);
  edge.information = symmetric(previous_.state.reference_T_frame.covariance.inverse());
  result.registration.information = information_of_inverse(edge.information, keyframe_T_frame);
  const TurningPoints::Touch touch{result.frame, surface, keyframe_->trial_T_keyframe * keyframe_T_frame,
                                   edge};
  static_cast<TurningPoints::Touch&>(previous_) = touch;
  previous_.time_s = result.time_s;
  result.status = TrackStatus::tracked;
  result.trial = trial_;
  result.trial_T_frame = touch.trial_T_frame;
  result.keyframe = keyframe_;
  result.keyframe_T_frame = keyframe_T_frame;
  // A frame whose contact the previous frame does not confirm does not become a keyframe.
  const double halfway_to_all = 0.5 * (1 + options_.keyframe_min_shared);
  if (confirmed < halfway_to_all) return;
  const bool keyframe_is_new =
      !result.new_keyframes.empty() && result.new_keyframes.back().keyframe == keyframe_;
  if (!keyframe_is_new && shared_with_keyframe(registration, *surface) < options_.keyframe_min_shared) {
    switch_keyframe(result, touch, registrar_(surface));
    result.keyframe = keyframe_;
    result.keyframe_T_frame = Pose::Identity();
  } else if (const auto left = turning_points_.pass(touch)) {
    result.new_keyframes.push_back(make_keyframe(*left, true));
  }
}

std::vector<NewKeyframe> Tracker::end_trial() {
  in_trial_ = false;
  const std::optional<TurningPoints::Touch> touch = turning_points_.end_trial();
  if (!touch) return {};
  return {make_keyframe(*touch, true)};
}

NewKeyframe Tracker::make_keyframe(const TurningPoints::Touch& touch, bool is_patch) {
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = next_keyframe_id_++;
  keyframe->frame = touch.frame;
  keyframe->trial = trial_;
  keyframe->is_patch = is_patch;
  keyframe->trial_T_keyframe = normalized(touch.trial_T_frame);
  keyframe->surface = StoredSurface::packed_later(touch.surface);
  keyframe->reference = StoredReference(keyframe->surface, normal_flow_);
  NewKeyframe added{keyframe, touch.edge};
  if (added.edge) added.edge->to = keyframe->id;
  return added;
}

void Tracker::begin_trial(TrackedFrame& result, const SurfacePtr& surface) {
  result.new_keyframes = end_trial();
  ++trial_;
  in_trial_ = true;
  const TurningPoints::Touch touch{result.frame, surface};
  result.new_keyframes.push_back(make_keyframe(touch));
  keyframe_ = result.new_keyframes.back().keyframe;
  reference_ = registrar_(surface);
  turning_points_.begin_trial(touch);
  previous_ = {touch, result.time_s, {}};
  previous_.state.center_mm.head<2>() = contact_center_mm(*surface);
  hand_ = {};
  result.trial = trial_;
  result.keyframe = keyframe_;
}

void Tracker::switch_keyframe(TrackedFrame& result, const TurningPoints::Touch& touch,
                              PreparedReference reference) {
  if (const auto before = turning_points_.add_keyframe(touch))
    result.new_keyframes.push_back(make_keyframe(*before, true));
  result.new_keyframes.push_back(make_keyframe(touch));
  keyframe_ = result.new_keyframes.back().keyframe;
  reference_ = std::move(reference);
  previous_.state = previous_.state.in_itself();
}

}  // namespace gelslam
