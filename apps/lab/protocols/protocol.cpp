#include "protocols/protocol.hpp"

#include <utility>

#include "studies/study.hpp"

namespace gelslam {

MethodRun::MethodRun(Registrar registrar, Protocol protocol, const SlamOptions& options)
    : registrar_(std::move(registrar)),
      protocol_(protocol),
      options_(options),
      tracker_(options.tracker, registrar_, options.registration, options.verification) {}

void MethodRun::add(const TrialFrame& frame) {
  const bool contact = frame.surface->contact_mm2() >= options_.tracker.min_contact_mm2;
  if (!first_T_start_) {
    if (!contact || !frame.start_T_frame) return;
    first_T_start_ = frame.start_T_frame->inverse();
  }
  const Answer answer = protocol_ == Protocol::frame0 ? against_first(frame) : with_tracker(frame);
  if (!frame.start_T_frame) return;
  estimates_.push_back(
      {frame.frame, answer.tracked, first_T_last_, *first_T_start_ * *frame.start_T_frame, answer.cpu_ms});
}

MethodRun::Answer MethodRun::against_first(const TrialFrame& frame) {
  if (!reference_) {
    reference_ = registrar_(frame.surface);
    return {true, 0};
  }
  const double start_ms = lab::thread_cpu_ms();
  const RegistrationResult result = reference_->register_to(*frame.surface, first_T_last_.inverse());
  const double spent_ms = lab::thread_cpu_ms() - start_ms;
  // The published protocol has no acceptance tests; a registration fails only if there is no overlap at all.
  if (result.shared_samples >= options_.registration.min_shared_samples)
    first_T_last_ = result.target_T_reference.inverse();
  return {result.ok(), spent_ms};
}

MethodRun::Answer MethodRun::with_tracker(const TrialFrame& frame) {
  const double start_ms = lab::thread_cpu_ms();
  const TrackedFrame tracked = tracker_.track(frame.frame, frame.time_s, frame.surface);
  const double spent_ms = lab::thread_cpu_ms() - start_ms;
  if (tracked.trial < 0) return {false, spent_ms};
  const bool first_ever = trial_ < 0, same_trial = tracked.trial == trial_;
  // The pose of the new trial relative to the old one is not known.
  if (!same_trial) first_T_trial_ = first_T_last_;
  trial_ = tracked.trial;
  first_T_last_ = first_T_trial_ * tracked.trial_T_frame;
  // A trial may begin with the previous frame, which was lost, if that frame and this one can be registered
  // to each other.
  const bool fits_the_one_before =
      tracked.status == TrackStatus::tracked && tracked.keyframe->frame != tracked.frame;
  return {same_trial || first_ever || fits_the_one_before, spent_ms};
}

}  // namespace gelslam
