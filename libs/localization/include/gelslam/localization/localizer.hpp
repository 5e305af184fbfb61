#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/localization/surface_map.hpp"
#include "gelslam/slam/frame_report.hpp"

namespace gelslam {

/// The sensor's pose in a known map, from the first touch on: a filter over hypotheses. Each touch moves
/// every hypothesis as it was tracked, registers it to the map there and weighs it by how well it fits. As
/// long as no hypothesis is certain, each touch that shows new surface is searched for in the whole map, and
/// hypotheses that a symmetry of the map makes equal are added. Before the first one counts as certain, it is
/// compared with all places where the map looks the same. Deterministic. Not thread-safe. Source: own
/// (docs/localization.md).
class Localizer {
 public:
  Localizer(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options);

  /// Finds the next frame; frames must come in order. Its place in the trial is known without the map.
  FrameReport process(std::int64_t frame, double time_s, SurfacePtr surface, std::int64_t unix_us = 0);

 private:
  /// A frame by which hypotheses are judged.
  struct Touch {
    Keyframe keyframe;  ///< the frame itself
    double time_s = 0;
    int reference_id = -1;  ///< the tracker's keyframe: frames with the same one are one touch
    Pose trial_T_sensor = Pose::Identity();
    Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();  ///< of the contact
    double weight = 1;                                    ///< share of it that the next touch does not show
    double best_log_odds = 0;                             ///< of the hypothesis that fits it best
    double best_rmse_rad = 0;                             ///< of the same
  };
  struct Hypothesis {
    UncertainPose map_T_sensor;
    MapFit fit;                ///< of the newest frame
    double past_log_odds = 0;  ///< of finished touches
    double log_odds = 0;       ///< of the current one (weigh())
    double last_fit_s = 0;     ///< when it last fitted the map
    double last_agreed_s = 0;  ///< the same, or when the map last did not show its place

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
  void weigh(const Touch& frame);
  void remove_refuted(const Touch& touch);
  std::vector<double> probabilities() const;
  Localization conclude(const Touch& touch) const;

  std::shared_ptr<const SurfaceMap> map_;
  SlamOptions options_;
  Tracker tracker_;
  TrialMap trial_map_;
  int trial_ = -1;
  Pose trial_T_sensor_ = Pose::Identity();  ///< of the frame before
  std::vector<Hypothesis> hypotheses_;
  std::vector<Touch> touches_;     ///< of the trial; the last one is the current one, by its largest frame
  bool looked_elsewhere_ = false;  ///< in this trial, all places that look like the best were added
  int looked_from_ = -1;           ///< the map's keyframe at which add_similar_places() looked last
  int searched_contact_px_ = 0;    ///< contact of the current touch when it was last searched for
  std::vector<Pose> last_places_;  ///< hypotheses of the trial before
};

}  // namespace gelslam
