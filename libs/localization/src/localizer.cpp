// Localization in a known map by a filter over hypotheses of map_T_sensor (not in the papers;
// docs/localization.md).
//
// Each tracked frame moves all hypotheses by the tracker's motion, registers the touch to the keyframe of the
// map that shows most of it there, and updates the evidence of each hypothesis. The evidence is a sum of log
// odds against chance, in nats: it rises with the correlation of the texture, falls when verification rejects
// the place, and stays where the map does not cover the touch. Frames with the same tracker keyframe are one
// touch, which counts once; a touch counts as far as the next one does not show the same contact. The
// probability of a hypothesis is exp(log odds) over the sum of all, where the case that all hypotheses are
// wrong has log odds 0.
//
// Limitation: a place that recognition never proposes, and that no symmetry leads to, is not found.

#include "gelslam/localization/localizer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/registration/relocalization.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/surface/contact_overlap.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

constexpr double kCertain = 0.95;  // Probability from which one hypothesis is reported as the pose.
// Log odds of a touch whose texture correlation just reaches VerificationOptions::sure_texture_correlation.
// Such a touch alone makes a place certain.
const double kSureLogOdds = std::log(kCertain / (1 - kCertain));
// A hypothesis with these log odds relative to the best one is removed.
const double kNegligibleLogOdds = std::log(1e-3);
constexpr double kSearchGrowth = 1.5;  // A contact that has grown by this factor is searched for again.
// Upper limit; the corners of a cube give as many symmetric hypotheses.
constexpr std::size_t kMaxHypotheses = 24;
// Largest number of registrations per search for symmetric places.
constexpr std::size_t kMaxSymmetricTries = 48;
constexpr std::size_t kMaxTouches = 8;  // Finished touches by which a new hypothesis is judged.

Matrix6d inverse(const Matrix6d& matrix) { return symmetric(inverted(matrix)); }

/// Says whether two standard deviations of the pose, translation and rotation, are below the distance between
/// two distinct places (kMinPeriodMm).
bool is_known_well(const UncertainPose& place) {
  const double turn_rad = worst_sigma(place.covariance.topLeftCorner<3, 3>());
  return 2 * std::max(place.worst_sigma_mm(), kMmPerRad * turn_rad) <= kMinPeriodMm;
}

std::string reason_without_track(const TrackedFrame& tracked) {
  if (tracked.status == TrackStatus::background) return "";
  if (tracked.status == TrackStatus::no_contact) return "nothing touches the sensor";
  return "track was lost: " + std::string(describe(tracked.registration.status));
}

}  // namespace

Localizer::Localizer(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options)
    : map_(std::move(map)),
      options_(options),
      tracker_(options.tracker, options.registration, options.verification),
      trial_map_(options.gradient_scale) {}

FrameReport Localizer::process(std::int64_t frame, double time_s, SurfacePtr surface, std::int64_t unix_us) {
  FrameReport report{.tracked = tracker_.track(frame, time_s, surface, unix_us), .surface = surface};
  const TrackedFrame& tracked = report.tracked;
  report.in_trial = trial_map_.add(tracked);
  if (tracked.status != TrackStatus::tracked) {
    report.localization = Localization{.reason = reason_without_track(tracked)};
    return report;
  }
  const Touch touch = make_touch(tracked, std::move(surface));
  if (tracked.trial != trial_)
    begin_trial(touch);
  else
    predict(tracked);
  if (touches_.empty() || touches_.back().reference_id != touch.reference_id) begin_touch(touch);
  correct(touch);
  if (!is_certain() && shows_new_surface(touch)) {
    for (const Pose& map_T_sensor : recognized(touch)) add(touch, {map_T_sensor}, PlacePrior::loop_candidate);
    add_symmetric(touch, Matrix6d::Zero(), PlacePrior::loop_candidate);
    searched_contact_px_ = touch.keyframe.surface->contact_pixels;
  }
  weigh(touch);
  if (!looked_elsewhere_ && is_certain()) {
    add_similar_places(touch);
    weigh(touch);
  }
  remove_refuted(touch);
  report.localization = conclude(touch);
  if (report.localization->status == PlaceStatus::localized)
    report.in_map = MapPlace{report.localization->hypotheses.front().map_T_sensor};
  return report;
}

Localizer::Touch Localizer::make_touch(const TrackedFrame& tracked, SurfacePtr surface) const {
  Touch touch;
  touch.time_s = tracked.time_s;
  touch.reference_id = tracked.keyframe->id;
  touch.trial_T_sensor = tracked.trial_T_frame;
  touch.center_mm = extent_of(coarse_contact_points_mm(*surface)).center_mm;
  touch.keyframe.frame = tracked.frame;
  touch.keyframe.trial = tracked.trial;
  touch.keyframe.reference = std::make_shared<const NormalFlowReference>(surface, options_.registration);
  touch.keyframe.surface = std::move(surface);
  return touch;
}

/// Resets the filter: contact was broken or tracking failed, so the object may be anywhere.
void Localizer::begin_trial(const Touch& touch) {
  if (!hypotheses_.empty()) last_places_.clear();
  for (const Hypothesis& h : hypotheses_) last_places_.push_back(h.map_T_sensor.pose);
  hypotheses_.clear();
  touches_.clear();
  looked_elsewhere_ = false;
  looked_from_ = -1;
  trial_ = touch.keyframe.trial;
  trial_T_sensor_ = touch.trial_T_sensor;
}

/// Begins a touch. The finished one counts only with the fraction of its contact that the new touch does not
/// show again.
void Localizer::begin_touch(const Touch& touch) {
  if (!touches_.empty()) {
    Touch& before = touches_.back();
    before.weight = 1 - contact_overlap(*before.keyframe.surface.get(), *touch.keyframe.surface.get(),
                                        before.trial_T_sensor.inverse() * touch.trial_T_sensor);
    for (Hypothesis& h : hypotheses_) h.past_log_odds += before.weight * std::exchange(h.log_odds, 0);
  }
  if (touches_.size() == kMaxTouches) touches_.erase(touches_.begin());
  touches_.push_back(touch);
  searched_contact_px_ = 0;
}

/// Moves every hypothesis by the tracked motion.
void Localizer::predict(const TrackedFrame& tracked) {
  const UncertainPose step{
      trial_T_sensor_.inverse() * tracked.trial_T_frame,
      uncertain_motion(odometry_edge(tracked.keyframe->id, -1, tracked.registration)).from_T_to.covariance};
  trial_T_sensor_ = tracked.trial_T_frame;
  for (Hypothesis& h : hypotheses_) {
    h.map_T_sensor = compose(h.map_T_sensor, step);
    h.map_T_sensor.pose = normalized(h.map_T_sensor.pose);
  }
}

/// Registers the touch to the map at every hypothesis. The information from before counts half, because
/// consecutive frames share their errors.
void Localizer::correct(const Touch& touch) {
  for (Hypothesis& h : hypotheses_) {
    h.fit = map_->fit(*touch.keyframe.reference.get(), h.map_T_sensor, PlacePrior::odometry);
    if (!h.fit.covered || h.fit.ok()) h.last_agreed_s = touch.time_s;
    if (!h.fit.ok()) continue;
    h.last_fit_s = touch.time_s;
    const Matrix6d before = h.map_T_sensor.covariance;
    h.map_T_sensor = h.fit.map_T_sensor;
    h.map_T_sensor.covariance = inverse(inverse(h.fit.map_T_sensor.covariance) + 0.5 * inverse(before));
  }
}

bool Localizer::shows_new_surface(const Touch& touch) const {
  return touch.keyframe.surface.facts().contact_pixels > kSearchGrowth * searched_contact_px_;
}

/// Returns candidate poses from place recognition, and the hypotheses of the previous trial, whose places are
/// worth a try.
std::vector<Pose> Localizer::recognized(const Touch& touch) const {
  std::vector<Pose> poses = map_->recognize(touch.keyframe);
  poses.insert(poses.end(), last_places_.begin(), last_places_.end());
  return poses;
}

bool Localizer::is_known(const Touch& touch, const Pose& map_T_sensor) const {
  return std::any_of(hypotheses_.begin(), hypotheses_.end(), [&](const Hypothesis& h) {
    return pose_distance_mm(h.map_T_sensor.pose, map_T_sensor, touch.center_mm) < kMinPeriodMm;
  });
}

/// Adds a hypothesis if the touch fits the map at the pose, and judges it by all touches of the trial.
void Localizer::add(const Touch& touch, const UncertainPose& map_T_sensor, PlacePrior prior) {
  if (hypotheses_.size() == kMaxHypotheses || is_known(touch, map_T_sensor.pose)) return;
  Hypothesis h;
  h.fit = map_->fit(*touch.keyframe.reference.get(), map_T_sensor, prior);
  if (!h.fit.ok() || is_known(touch, h.fit.map_T_sensor.pose)) return;
  h.map_T_sensor = h.fit.map_T_sensor;
  h.last_fit_s = h.last_agreed_s = touch.time_s;
  const UncertainPose map_T_trial = compose(h.map_T_sensor, {touch.trial_T_sensor.inverse()});
  for (std::size_t i = 0; i + 1 < touches_.size(); ++i) {
    const Touch& before = touches_[i];
    const MapFit fit = map_->fit(*before.keyframe.reference.get(),
                                 compose(map_T_trial, {before.trial_T_sensor}), PlacePrior::odometry);
    h.past_log_odds += before.weight * log_odds(fit, before);
  }
  hypotheses_.push_back(h);
}

/// Adds places that follow from a symmetry: if the map fits at two poses, it looks the same after the motion
/// between them, and may do so after the same motion from any other hypothesis, too.
void Localizer::add_symmetric(const Touch& touch, const Matrix6d& covariance, PlacePrior prior) {
  std::vector<Pose> tried;
  for (std::size_t i = 0; i < hypotheses_.size(); ++i)
    for (std::size_t j = 0; j < hypotheses_.size(); ++j)
      for (std::size_t k = 0; k < hypotheses_.size() && i != j; ++k) {
        const Pose place = hypotheses_[j].map_T_sensor.pose * hypotheses_[i].map_T_sensor.pose.inverse() *
                           hypotheses_[k].map_T_sensor.pose;
        const bool was_tried = std::any_of(tried.begin(), tried.end(), [&](const Pose& other) {
          return pose_distance_mm(other, place, touch.center_mm) < kMinPeriodMm;
        });
        if (was_tried || is_known(touch, place)) continue;
        if (tried.size() == kMaxSymmetricTries) return;
        tried.push_back(place);
        add(touch, {place, covariance}, prior);
      }
}

/// Place recognition compares a touch with only a few keyframes and may miss a place that looks the same.
/// Therefore the map's own keyframe at the best hypothesis is searched for in the map, and each place found
/// becomes a hypothesis with the covariance of the best one. If that keyframe is not even recognized at its
/// own place, the map repeats itself there, and no place counts as certain.
void Localizer::add_similar_places(const Touch& touch) {
  const auto best = std::max_element(hypotheses_.begin(), hypotheses_.end(),
                                     [](const auto& a, const auto& b) { return a.total() < b.total(); });
  if (!best->fit.ok() || best->fit.keyframe == looked_from_) return;
  looked_from_ = best->fit.keyframe;
  const auto [here, covariance] = best->map_T_sensor;
  for (const Pose& map_T_sensor : map_->similar_places(best->fit)) {
    looked_elsewhere_ |= pose_distance_mm(here, map_T_sensor, touch.center_mm) < kMinPeriodMm;
    add(touch, {map_T_sensor, covariance}, PlacePrior::odometry);
  }
  add_symmetric(touch, covariance, PlacePrior::odometry);
}

/// Compares residuals at the frame by which the touch is judged.
bool Localizer::fits_as_well_as_best(const MapFit& fit, const Touch& touch) const {
  const double best_rad = std::max(touch.best_rmse_rad, options_.registration.normal_noise_rad);
  return fit.ok() && fit.registration.normal_rmse_rad < options_.verification.rival_residual * best_rad;
}

/// Returns the log odds (nats, negative against the place) that a touch gives for a place compared with
/// chance. They are 0 where the map does not cover the touch, or where the texture correlates no better than
/// required. A place that fits as well as the best one is as likely as that one.
double Localizer::log_odds(const MapFit& fit, const Touch& touch) const {
  if (!fit.covered) return 0;
  if (!fit.ok()) return -kSureLogOdds;
  const VerificationOptions& limits = options_.verification;
  const double above = fit.registration.texture_correlation - limits.min_texture_correlation;
  const double own =
      kSureLogOdds *
      std::max(0.0, above / (limits.sure_texture_correlation - limits.min_texture_correlation));
  return fits_as_well_as_best(fit, touch) ? std::max(own, touch.best_log_odds) : own;
}

/// Updates the log odds of the current touch, which is judged by its frame with the largest contact. For a
/// place that still fits best, the log odds never decrease within a touch: the errors of the gradient model
/// and of the map vary over the contact, and a correlation that falls because of them is no evidence against
/// the place.
void Localizer::weigh(const Touch& frame) {
  Touch& touch = touches_.back();
  if (frame.keyframe.surface->contact_pixels < touch.keyframe.surface->contact_pixels) return;
  touch = frame;
  for (const Hypothesis& h : hypotheses_) {
    if (!h.fit.ok()) continue;
    const double own = log_odds(h.fit, frame);
    if (own <= touch.best_log_odds) continue;
    touch.best_log_odds = own;
    touch.best_rmse_rad = h.fit.registration.normal_rmse_rad;
  }
  for (Hypothesis& h : hypotheses_) {
    const double said = fits_as_well_as_best(h.fit, touch) ? h.log_odds : -kSureLogOdds;
    h.log_odds = std::max(said, log_odds(h.fit, touch));
  }
}

/// Removes hypotheses that have converged to the pose of a more likely one, that the map has contradicted for
/// patience_s, or that are negligible compared with the best one, or with the case that the touch lies in a
/// part of the object that the map does not contain.
void Localizer::remove_refuted(const Touch& touch) {
  std::stable_sort(hypotheses_.begin(), hypotheses_.end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.total() > b.total(); });
  std::vector<Hypothesis> all;
  std::swap(all, hypotheses_);
  for (Hypothesis& h : all) {
    const double rival = hypotheses_.empty() ? 0.0 : std::max(0.0, hypotheses_.front().total());
    const bool contradicted = touch.time_s - h.last_agreed_s > options_.tracker.patience_s;
    if (!contradicted && h.total() - rival > kNegligibleLogOdds && !is_known(touch, h.map_T_sensor.pose))
      hypotheses_.push_back(std::move(h));
  }
}

/// Returns the probability of each hypothesis. They sum to less than 1; the remainder is the probability that
/// all are wrong.
std::vector<double> Localizer::probabilities() const {
  double most = 0, sum = 0;
  for (const Hypothesis& h : hypotheses_) most = std::max(most, h.total());
  std::vector<double> shares;
  for (const Hypothesis& h : hypotheses_) sum += shares.emplace_back(std::exp(h.total() - most));
  for (double& share : shares) share /= sum + std::exp(-most);
  return shares;
}

bool Localizer::is_certain() const {
  const std::vector<double> shares = probabilities();
  return std::any_of(shares.begin(), shares.end(), [](double share) { return share >= kCertain; });
}

Localization Localizer::conclude(const Touch& touch) const {
  Localization result;
  const std::vector<double> shares = probabilities();
  for (std::size_t i = 0; i < hypotheses_.size(); ++i)
    result.hypotheses.push_back({hypotheses_[i].map_T_sensor, shares[i]});
  if (hypotheses_.empty()) {
    result.reason = "no place of the map looks like this touch";
    return result;
  }
  const Hypothesis& best = hypotheses_.front();
  if (touch.time_s - best.last_fit_s > options_.tracker.patience_s) {
    result.hypotheses.clear();
    result.reason = "beyond what the map shows";
    return result;
  }
  result.status = PlaceStatus::ambiguous;
  if (shares.front() < kCertain) {
    result.reason = hypotheses_.size() > 1 ? "several places of the map look like this touch"
                                           : "this touch shows too little to be certain";
  } else if (!looked_elsewhere_) {
    result.reason = "the map repeats itself here";
  } else if (!is_known_well(best.map_T_sensor)) {
    result.reason = describe_observability(best.fit.registration.observable);
  } else {
    result.status = PlaceStatus::localized;
    result.hypotheses.resize(1);
  }
  return result;
}

}  // namespace gelslam
