#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

struct LoopClosureOptions {
  double sift_contrast_threshold = 0.02;
  int sift_octave_layers = 3;
  int max_features = 300;  ///< per keyframe, the strongest
  /// distance of a match over that of the second best: repeated patterns fail here
  double max_match_ratio = 0.9;
  int min_sift_inliers = 8;
  /// Correlation of a curvature map with its own shifts (1 mm or more) above which it proves no place: a
  /// cloth or a thread has 0.95, a knurl 0.6, other objects below 0.5. verify() does not ask for this, its
  /// guess says which one.
  double max_self_similarity = 0.8;
  double ransac_threshold_px = 3.0;
  int ransac_iterations = 100;
  int max_candidates = 20;  ///< keyframes that are compared feature by feature, after voting
  int max_constraints = 6;  ///< per keyframe, the most alike first: more loops to one place add little
  int max_neighbor_constraints = 2;  ///< besides, to the last 12 keyframes of the same trial
  /// Of curvature without its mean, over the shared contact; on a ball only the mean agrees. Measured on
  /// sequences with truth: right places 0.6 (a pen) to 0.97, wrong ones below 0.51.
  double min_texture_correlation = 0.6;
  double sure_texture_correlation = 0.75;  ///< below it a loop is tentative: it takes two to join trials
  double max_height_rmse_mm = 0.1;         ///< heights must agree, too; right places have 0.03
  double max_free_space_violation =
      0.1;                         ///< share of either's contact that would lie inside the other's bare gel
  NormalFlowOptions registration;  ///< its scr/ccs thresholds are the gates; SCR of the smaller contact
};

/// A keyframe seen again: `from` is the older one. from_T_to maps the newer keyframe's coordinates into the
/// older's; information as in RegistrationResult (right perturbation, axes of the newer keyframe).
struct LoopConstraint {
  int from = 0, to = 0;  ///< keyframe ids
  Pose from_T_to = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  /// of what both show, in the newer keyframe's frame
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();
  int sift_inliers = 0;  ///< 0 when the place was guessed by a pose instead of recognised
  double scr = 0, ccs = 0;
  double texture_correlation = 0;   ///< of curvature with its mean removed, over the shared contact
  double height_rmse_mm = 0;        ///< over the shared contact, mean difference taken off
  double free_space_violation = 0;  ///< share of either's contact that lies inside the other's bare gel
  bool tentative = false;           ///< PoseGraphEdge::tentative
};

/// Recognises places by SIFT on curvature maps and verifies each by NormalFlow (Huang et al., T-RO 2026, §V;
/// voting and the lift to 3-D are our own). Deterministic. Not thread-safe.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopClosureOptions& options);
  ~LoopCloser();

  /// Compares `keyframe` with all kept keyframes except its direct predecessor in the same trial, then keeps
  /// it for later ones. Every keyframe added is searched for. Ids must grow.
  std::vector<LoopConstraint> add(const Keyframe& keyframe);

  /// Forgets the keyframes with this id and later ones, as if they had never been added.
  void forget_from(int keyframe_id);

  /// Registers two keyframes from a guess that came from elsewhere (the pose graph's prediction of an
  /// overlap), with the same gates as add(). Nothing when they do not show the same surface.
  std::optional<LoopConstraint> verify(const Keyframe& older, const Keyframe& newer,
                                       const Pose& older_T_newer_guess) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
