#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/localization/surface_map.hpp"
#include "gelslam/slam/frame_report.hpp"

namespace gelslam {

/// Estimates the sensor's pose in a known map, without a prior pose. It is a filter over hypotheses of
/// map_T_sensor. Each tracked frame moves every hypothesis by the tracked motion and is registered to the map
/// at the predicted pose. How well the largest contact of each touch fits is the evidence for a hypothesis.
/// While no hypothesis is certain, each touch that shows new surface is searched for in the whole map, and
/// hypotheses that follow from a symmetry of the map are added. Before the first hypothesis counts as
/// certain, all places of the map that look like its place are added, too. Deterministic. Not thread-safe.
/// Not in the papers (docs/localization.md).
class Localizer {
 public:
  Localizer(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options);

  /// Processes the next frame; frames must be passed in order. The report also has its pose in the trial,
  /// which does not depend on the map.
  FrameReport process(std::int64_t frame, double time_s, SurfacePtr surface, std::int64_t unix_us = 0);

 private:
  /// One frame of a touch. Here a touch is a stretch of frames with the same keyframe of the tracker, and the
  /// frame with the largest contact stands for it.
  struct Touch {
    Keyframe keyframe;  ///< the frame itself
    double time_s = 0;
    /// Id of the tracker's keyframe. Consecutive frames with the same keyframe count as one touch.
    int reference_id = -1;
    Pose trial_T_sensor = Pose::Identity();
    Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();  ///< the center of the contact
    double weight = 1;         ///< Fraction of its contact that the next touch does not show again.
    double best_log_odds = 0;  ///< Largest log odds (nats) that this touch gives for a hypothesis.
    double best_rmse_rad = 0;  ///< Residual (rad) of that hypothesis.
  };
  struct Hypothesis {
    UncertainPose map_T_sensor;
    MapFit fit;                ///< Fit of the newest frame to the map.
    double past_log_odds = 0;  ///< Log odds (nats) from finished touches.
    double log_odds = 0;       ///< Log odds (nats) from the current touch (weigh()).
    double last_fit_s = 0;     ///< Time of the last frame that fitted the map.
    /// Time of the last frame that did not contradict the hypothesis: the frame fitted the map, or the map
    /// did not cover it.
    double last_agreed_s = 0;

    double total() const { return past_log_odds + log_odds; }
  };

  Touch make_touch(const TrackedFrame& tracked, SurfacePtr surface) const;
  void begin_trial(const Touch& touch);
  void begin_touch(const Touch& touch);
  void predict(const TrackedFrame& tracked);
  void correct(const Touch& touch);
  bool is_certain() const;
  bool shows_new_surface(const Touch& touch) const;
  std::vector<Pose> recognized(const Touch& touch) const;
  void add(const Touch& touch, const UncertainPose& map_T_sensor, PlacePrior prior);
  void add_symmetric(const Touch& touch, const Matrix6d& covariance, PlacePrior prior);
  void add_similar_places(const Touch& touch);
  bool is_known(const Touch& touch, const Pose& map_T_sensor) const;
  bool fits_as_well_as_best(const MapFit& fit, const Touch& touch) const;
  double log_odds(const MapFit& fit, const Touch& touch) const;
  void weigh(const Touch& touch);
  void remove_refuted(const Touch& touch);
  std::vector<double> probabilities() const;
  Localization conclude(const Touch& touch) const;

  std::shared_ptr<const SurfaceMap> map_;
  SlamOptions options_;
  Tracker tracker_;
  TrialMap trial_map_;
  int trial_ = -1;
  Pose trial_T_sensor_ = Pose::Identity();  ///< Pose of the previous frame in the trial.
  std::vector<Hypothesis> hypotheses_;
  /// Touches of the trial. The last one is the current one, represented by its frame with the largest
  /// contact.
  std::vector<Touch> touches_;
  /// Whether all places that look like that of the best hypothesis were added in this trial.
  bool looked_elsewhere_ = false;
  int looked_from_ = -1;           ///< Id of the map's keyframe that add_similar_places() searched for last.
  int searched_contact_px_ = 0;    ///< Contact pixels of the current touch when it was last searched for.
  std::vector<Pose> last_places_;  ///< Poses of the hypotheses at the end of the previous trial.
};

}  // namespace gelslam
