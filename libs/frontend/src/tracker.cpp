#include "gelslam/frontend/tracker.hpp"

#include <algorithm>

#include "gelslam/registration/relocalization.hpp"

namespace gelslam {
namespace {

// Frames that follow each other bring no larger innovation (of 7600 frames of 19 sequences 5 do, 4 of them of
// a polished ball): a hand's speed changes by a tenth of a millimetre and by one degree in 0.04 s.
constexpr double kUsualInnovationMm = 0.2;
// Nor do normals suddenly fit so many times worse than one frame before, but as a contact begins.
constexpr double kUsualResidualRise = 1.5;
constexpr double kFirstResidualRad = 0.05;  // of a trial's first step
constexpr double kLeastResidualRad = 0.03;
// After a longer gap a pattern may have moved on by a period.
constexpr double kLongestStepS = 0.17;
// Up to twice as large as usual, a step is likelier than one so many times as far.
constexpr double kJumpIsUnlikely = 2.5;
// Within so long no hand moves a pattern by a period, and by the same again.
constexpr double kSteadyStepS = 0.06;

bool is_large_innovation(const RegistrationResult& registration, const Pose& reference_T_expected,
                         double usual = 1) {
  return innovation_mm(registration, reference_T_expected.inverse()) > usual * kUsualInnovationMm;
}

/// Do the normals suddenly fit much worse?
bool is_worse(const RegistrationResult& registration, double residual_before_rad) {
  return registration.normal_rmse_rad > kUsualResidualRise * std::max(residual_before_rad, kLeastResidualRad);
}

/// Known in all directions but along z, which has a zero of its own. A frame that is not would bring into the
/// map what was guessed of its place.
bool is_placed(const RegistrationResult& registration) {
  constexpr std::size_t kZ = 2;
  for (std::size_t axis = 0; axis < registration.observable.size(); ++axis)
    if (axis != kZ && !registration.observable[axis]) return false;
  return true;
}

}  // namespace

std::string_view name(TrackStatus status) {
  switch (status) {
    case TrackStatus::background:
      return "background";
    case TrackStatus::no_contact:
      return "no_contact";
    case TrackStatus::tracked:
      return "tracked";
    case TrackStatus::lost:
      return "lost";
    case TrackStatus::undone:
      return "undone";
  }
  return "unknown";
}

TrackedFrame Tracker::track(std::int64_t frame, double time_s, SurfacePtr surface) {
  TrackedFrame result;
  result.frame = frame;
  result.time_s = time_s;
  if (surface->contact_pixels < options_.contact_threshold_px) {
    hand_out_turning_point(result, turning_points_.end_trial());
    in_trial_ = false;
    return result;
  }
  if (!in_trial_) {
    result.status = TrackStatus::tracked;
    begin_trial(result, {frame, time_s, surface}, registrar_->prepare(surface));
    // Against itself: what this surface can show at all.
    result.registration = reference_->register_to(*surface, Pose::Identity());
    return result;
  }
  RegistrationResult registration = go_on(*surface, time_s);
  if (!registration.ok()) registration = follow(result, *surface);
  if (registration.ok()) {
    accept(result, std::move(surface), registration);
  } else {
    result.registration = registration;
    lose(result, std::move(surface));
  }
  return result;
}

/// To the keyframe; if that is too far behind, to the last tracked frame. If that is, too, or the step is an
/// unusual one, wherever the textures agree. The last tracked frame becomes a keyframe only if that helps.
RegistrationResult Tracker::follow(TrackedFrame& result, const Surface& surface) {
  const Pose& keyframe_T_previous = previous_->link.previous_T_this;
  const RegistrationResult on_keyframe = register_to(*reference_, keyframe_T_previous, surface);
  if (is_usual(on_keyframe, keyframe_T_previous, result.time_s)) return on_keyframe;

  std::shared_ptr<const PreparedReference> previous;
  RegistrationResult on_previous;
  if (previous_->frame != keyframe_->frame) {
    previous = registrar_->prepare(previous_->surface);
    on_previous = register_to(*previous, Pose::Identity(), surface);
  }
  const bool follows_previous = !on_keyframe.ok() && is_usual(on_previous, Pose::Identity(), result.time_s);
  if (!follows_previous) {
    const RegistrationResult place =
        place_on(*reference_, keyframe_T_previous, surface, on_keyframe, result.time_s);
    if (place.ok()) return place;
    if (previous) on_previous = place_on(*previous, Pose::Identity(), surface, on_previous, result.time_s);
    if (!on_previous.ok()) {
      if (on_keyframe.ok() && !unplaced_)
        doubtful_ = Doubtful{result.time_s, on_keyframe.target_T_reference.inverse()};
      return place;
    }
  }
  const Pose trial_T_previous = trial_T_keyframe_ * previous_->link.previous_T_this;
  switch_keyframe(result, {previous_->frame, previous_->surface, trial_T_previous, previous_->link},
                  std::move(previous));
  return on_previous;
}

/// But for its size, nothing about the step is suspicious.
bool Tracker::is_sound(const RegistrationResult& registration, double time_s) const {
  return registration.ok() && time_s - previous_->time_s <= kLongestStepS &&
         !is_worse(registration, previous_->residual_rad);
}

/// As the last step said, too, as far as a hand can change its mind until then, or where the frame before
/// was: a hand stops, and turns back.
bool Tracker::is_usual(const RegistrationResult& registration, const Pose& reference_T_previous,
                       double time_s) const {
  return is_sound(registration, time_s) &&
         (!is_large_innovation(registration, reference_T_previous * last_step_) ||
          !is_large_innovation(registration, reference_T_previous));
}

/// What is found once over a pattern may be a jump; what is found twice is a speed, of an object that was
/// moving when the trial began. Not ok if it is not.
RegistrationResult Tracker::go_on(const Surface& surface, double time_s) {
  const std::optional<Doubtful> doubtful = std::exchange(doubtful_, std::nullopt);
  if (!doubtful || time_s - doubtful->time_s > kSteadyStepS ||
      doubtful->time_s - previous_->time_s > kSteadyStepS)
    return {};
  const Pose step = previous_->link.previous_T_this.inverse() * doubtful->keyframe_T_frame;
  const Pose expected = doubtful->keyframe_T_frame * step;
  const RegistrationResult registration = reference_->register_to(surface, expected.inverse());
  if (!registration.ok() || is_large_innovation(registration, expected) ||
      is_worse(registration, previous_->residual_rad))
    return {};
  previous_->link.previous_T_this = doubtful->keyframe_T_frame;  // the speed is that of one frame
  unplaced_.reset();
  return registration;
}

/// The frame fits nothing that the trial has shown. It may be torn, or the object elsewhere.
void Tracker::lose(TrackedFrame& result, SurfacePtr surface) {
  result.status = TrackStatus::lost;
  const Seen seen{result.frame, result.time_s, surface};
  if (seen.time_s - previous_->time_s > options_.patience_s) {
    begin_trial(result, seen, registrar_->prepare(std::move(surface)));
    return;
  }
  if (unplaced_) {
    auto reference = registrar_->prepare(unplaced_->surface);
    const RegistrationResult together = reference->register_to(*surface, Pose::Identity());
    if (together.ok()) {
      begin_trial(result, Seen(*unplaced_), std::move(reference));
      accept(result, std::move(surface), together);
      return;
    }
  }
  unplaced_ = seen;
}

/// From the previous pose carried on at the last speed; if that fails, from the previous pose itself.
RegistrationResult Tracker::register_to(const PreparedReference& reference, const Pose& reference_T_previous,
                                        const Surface& surface) const {
  const Pose starts[] = {reference_T_previous * last_step_, reference_T_previous};
  RegistrationResult best;
  for (const Pose& reference_T_frame : starts) {
    RegistrationResult attempt = reference.register_to(surface, reference_T_frame.inverse());
    if (attempt.ok()) return attempt;
    if (attempt.scr * attempt.ccs >= best.scr * best.ccs) best = attempt;
  }
  return best;
}

/// The only place where the frame fits, whether it was expected there (`registration`) or not. Not ok when
/// there is none or several.
RegistrationResult Tracker::place_on(const PreparedReference& reference, const Pose& reference_T_previous,
                                     const Surface& surface, const RegistrationResult& registration,
                                     double time_s) const {
  if (!options_.search_far) return registration;
  const Pose reference_T_expected = reference_T_previous * last_step_;
  RelocalizationOptions search;
  if (is_sound(registration, time_s) && !is_large_innovation(registration, reference_T_expected, 2))
    search.rival_distance = kJumpIsUnlikely;
  const RegistrationResult place = relocalize(*reference.samples(), surface, reference_T_expected.inverse(),
                                              registration, options_.registration, search);
  // Another method starts from there and has the last word.
  return place.ok() ? reference.register_to(surface, place.target_T_reference) : place;
}

void Tracker::accept(TrackedFrame& result, SurfacePtr surface, const RegistrationResult& registration) {
  const KeyframeLink link = link_to(keyframe_, registration);
  const Pose& keyframe_T_frame = link.previous_T_this;
  // A speed along directions that the surface does not show would never be corrected, and one over lost
  // frames is not that of one: then no speed at all.
  last_step_ = registration.held || unplaced_ ? Pose::Identity()
                                              : previous_->link.previous_T_this.inverse() * keyframe_T_frame;
  previous_ = Previous{{result.frame, result.time_s, surface}, link, registration.normal_rmse_rad};
  unplaced_.reset();
  result.status = TrackStatus::tracked;
  result.trial = trial_;
  result.registration = registration;
  result.trial_T_frame = trial_T_keyframe_ * keyframe_T_frame;
  result.keyframe = keyframe_;
  result.keyframe_T_frame = keyframe_T_frame;
  const TurningPoints::Touch touch{result.frame, surface, result.trial_T_frame, link};
  const bool keyframe_is_new =
      !result.new_keyframes.empty() && result.new_keyframes.back().keyframe == keyframe_;
  if (!keyframe_is_new && keyframe_is_outgrown(registration, *surface)) {
    switch_keyframe(result, touch, registrar_->prepare(surface));
    result.keyframe = keyframe_;
    result.keyframe_T_frame = Pose::Identity();
  } else if (is_placed(registration)) {
    hand_out_turning_point(result, turning_points_.pass(touch));
  }
}

void Tracker::break_trial() {
  in_trial_ = false;
  turning_points_.end_trial();
}

bool Tracker::keyframe_is_outgrown(const RegistrationResult& registration, const Surface& surface) const {
  const double shared_share =
      static_cast<double>(registration.shared_pixels) / keyframe_->reference->sample_count();
  const double shared_area_px = shared_share * keyframe_->surface->contact_pixels;
  return shared_area_px < options_.keyframe_min_shared * surface.contact_pixels;
}

std::shared_ptr<const Keyframe> Tracker::make_keyframe(std::int64_t frame, const PreparedReference& reference,
                                                       SurfacePtr surface) {
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = next_keyframe_id_++;
  keyframe->frame = frame;
  keyframe->trial = trial_;
  keyframe->surface = std::move(surface);
  keyframe->reference = reference.samples();
  return keyframe;
}

/// With `first`, which is this frame or the one before.
void Tracker::begin_trial(TrackedFrame& result, const Seen& first,
                          std::shared_ptr<const PreparedReference> reference) {
  hand_out_turning_point(result, turning_points_.end_trial());
  ++trial_;
  in_trial_ = true;
  keyframe_ = make_keyframe(first.frame, *reference, first.surface);
  reference_ = std::move(reference);
  turning_points_.begin_trial({first.frame, first.surface, Pose::Identity(), {}});
  trial_T_keyframe_ = Pose::Identity();
  last_step_ = Pose::Identity();
  previous_ = Previous{first, KeyframeLink{keyframe_}, kFirstResidualRad};
  doubtful_.reset();
  unplaced_.reset();
  result.trial = trial_;
  result.keyframe = keyframe_;
  result.keyframe_T_frame = Pose::Identity();
  result.trial_T_frame = Pose::Identity();
  result.new_keyframes.push_back({keyframe_, {}});
}

void Tracker::switch_keyframe(TrackedFrame& result, const TurningPoints::Touch& touch,
                              std::shared_ptr<const PreparedReference> reference) {
  hand_out_turning_point(result, turning_points_.add_keyframe(touch));
  keyframe_ = make_keyframe(touch.frame, *reference, touch.surface);
  reference_ = std::move(reference);
  result.new_keyframes.push_back({keyframe_, touch.link});
  trial_T_keyframe_ = normalized(trial_T_keyframe_ * touch.link.previous_T_this);
  previous_->link = KeyframeLink{keyframe_};
}

void Tracker::hand_out_turning_point(TrackedFrame& result, const std::optional<TurningPoints::Touch>& touch) {
  if (!touch) return;
  result.new_keyframes.push_back(
      {make_keyframe(touch->frame, *registrar_->prepare(touch->surface), touch->surface), touch->link});
}

}  // namespace gelslam
