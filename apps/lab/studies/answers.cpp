#include "answers.hpp"

#include <memory>
#include <optional>

#include "baselines/baselines.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "protocols/trials.hpp"

namespace gelslam::lab {
namespace {

constexpr int kFpfhEvery = 20;

bool is_slow(const std::string& method) { return method.starts_with("fpfh"); }

/// A sequence seen by one method in one way, frame by frame.
class SequenceAnswers {
 public:
  SequenceAnswers(std::string where, std::string method, const SlamOptions& options)
      : where_(std::move(where)), method_(std::move(method)), options_(options) {}
  virtual ~SequenceAnswers() = default;
  /// Frames in order, from the first in contact with a known pose on.
  virtual void add(const TrialFrame& frame) = 0;
  const std::vector<Answer>& answers() const { return answers_; }

 protected:
  void note(const char* source, const TrialFrame& frame, const RegistrationResult& result,
            const Judgement& judgement) {
    answers_.push_back(
        {source, where_, "frame " + std::to_string(frame.frame), method_, result.scr, result.ccs, judgement});
  }

  std::string where_, method_;
  SlamOptions options_;
  std::vector<Answer> answers_;
};

/// As Protocol::frame0 of libs/benchmark.
class AgainstFirst final : public SequenceAnswers {
 public:
  using SequenceAnswers::SequenceAnswers;

  void add(const TrialFrame& frame) override {
    if (!frame.start_T_frame) return;
    if (!reference_) {
      reference_ = make_registrar(method_, options_.registration)->prepare(frame.surface);
      start_T_first_ = *frame.start_T_frame;
      return;
    }
    if (++seen_ % (is_slow(method_) ? kFpfhEvery : 1) != 0) return;
    const RegistrationResult result = reference_->register_to(*frame.surface, last_);
    if (result.shared_pixels >= options_.registration.min_shared_pixels) last_ = result.target_T_reference;
    const Pose truth = frame.start_T_frame->inverse() * start_T_first_;
    note("frame 0", frame, result,
         judge_pose_error(result.target_T_reference, truth, result.observable, result.ok()));
  }

 private:
  std::shared_ptr<const PreparedReference> reference_;
  Pose start_T_first_ = Pose::Identity(), last_ = Pose::Identity();
  int seen_ = 0;
};

class WithKeyframes final : public SequenceAnswers {
 public:
  WithKeyframes(std::string where, const std::string& method, const SlamOptions& options)
      : SequenceAnswers(std::move(where), method, options),
        tracker_(options.tracker, make_registrar(method, options.registration), options.registration,
                 options.verification) {}

  void add(const TrialFrame& frame) override {
    const TrackedFrame tracked = tracker_.track(frame.frame, frame.time_s, frame.surface);
    if (tracked.status == TrackStatus::lost && !tracked.keyframe && frame.start_T_frame) {
      note("keyframes", frame, tracked.registration, of_lost(tracked.registration, *frame.start_T_frame));
      return;
    }
    if (!frame.start_T_frame || tracked.trial < 0) {
      previous_.reset();
      start_T_keyframe_.reset();
      return;
    }
    const bool goes_on = tracked.trial == trial_ && tracked.status == TrackStatus::tracked;
    if (goes_on)
      note("keyframes", frame, tracked.registration, since_trial_start(tracked, *frame.start_T_frame));
    else if (previous_ && start_T_keyframe_)
      note("keyframes", frame, tracked.registration, of_lost(tracked.registration, *frame.start_T_frame));
    if (!goes_on) {
      start_T_trial_ = *frame.start_T_frame * tracked.trial_T_frame.inverse();
      trial_ = tracked.trial;
    }
    if (tracked.keyframe != keyframe_ || !start_T_keyframe_ || !goes_on)
      start_T_keyframe_ = keyframe_pose(tracked, *frame.start_T_frame);
    keyframe_ = tracked.keyframe;
    previous_ = *frame.start_T_frame;
  }

 private:
  /// True pose of the keyframe that the frame refers to: it is this frame or the one before.
  Pose keyframe_pose(const TrackedFrame& tracked, const Pose& start_T_frame) const {
    if (!tracked.keyframe || tracked.keyframe->frame == tracked.frame || !previous_) return start_T_frame;
    return *previous_;
  }

  Judgement since_trial_start(const TrackedFrame& tracked, const Pose& start_T_frame) const {
    return judge_pose_error(tracked.trial_T_frame.inverse(), start_T_frame.inverse() * start_T_trial_,
                            tracked.registration.observable, true);
  }

  Judgement of_lost(const RegistrationResult& result, const Pose& start_T_frame) const {
    const auto against = [&](const Pose& start_T_reference) {
      return judge_pose_error(result.target_T_reference, start_T_frame.inverse() * start_T_reference,
                              result.observable, false);
    };
    const Judgement to_previous = against(*previous_), to_keyframe = against(*start_T_keyframe_);
    return to_previous.right ? to_previous : to_keyframe;
  }

  Tracker tracker_;
  int trial_ = -1;
  Pose start_T_trial_ = Pose::Identity();
  std::shared_ptr<const Keyframe> keyframe_;
  std::optional<Pose> start_T_keyframe_, previous_;  ///< true; no previous one without contact
};

std::vector<std::unique_ptr<SequenceAnswers>> start_all(const std::string& where,
                                                        const std::vector<std::string>& methods,
                                                        const SlamOptions& options) {
  std::vector<std::unique_ptr<SequenceAnswers>> all;
  for (const std::string& method : methods) {
    all.push_back(std::make_unique<AgainstFirst>(where, method, options));
    if (!is_slow(method)) all.push_back(std::make_unique<WithKeyframes>(where, method, options));
  }
  return all;
}

}  // namespace

std::vector<Answer> answers_to(const StabilityLevel& level, const std::vector<std::string>& methods) {
  std::vector<Answer> answers;
  for (const std::string& method : methods) {
    if (is_slow(method) && is_basin(level.chart)) continue;
    const std::shared_ptr<const Registrar> registrar = make_registrar(method, NormalFlowOptions{});
    std::vector<std::shared_ptr<const PreparedReference>> prepared(level.set.references.size());
    for (const RegistrationProblem& problem : level.set.problems) {
      if (is_slow(method) && (problem.start_number > 0 || problem.reference % 2 != 0)) continue;
      auto& reference = prepared[problem.reference];
      if (!reference) reference = registrar->prepare(level.set.references[problem.reference]);
      const RegistrationResult result = reference->register_to(*problem.target, problem.start);
      answers.push_back({"generated", level.chart, problem.name, method, result.scr, result.ccs,
                         judge_result(problem, result)});
    }
  }
  return answers;
}

std::vector<Answer> answers_to(const std::filesystem::path& folder, int most_frames,
                               const std::vector<std::string>& methods) {
  std::vector<Answer> answers;
  for (const BenchmarkTrial& trial : find_trials({folder})) {
    TrialFrames frames(trial, {});
    const SlamOptions& options = frames.config().slam;
    const auto all = start_all(trial.name, methods, options);
    bool touched = false;
    for (int count = 0; count < most_frames;) {
      const std::optional<TrialFrame> frame = frames.next();
      if (!frame) break;
      touched = touched || (frame->start_T_frame &&
                            frame->surface->contact_pixels >= options.tracker.contact_threshold_px);
      if (!touched) continue;
      ++count;
      for (const auto& one : all) one->add(*frame);
    }
    for (const auto& one : all) answers.insert(answers.end(), one->answers().begin(), one->answers().end());
  }
  return answers;
}

}  // namespace gelslam::lab
