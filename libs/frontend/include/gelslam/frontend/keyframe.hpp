#pragma once

#include <cstdint>
#include <memory>

#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam {

/// A frame that later frames are registered to. What is large is kept in compact form: `surface` and
/// `reference` are made again when they are asked for.
struct Keyframe {
  int id = 0;              ///< counts keyframes of the whole log from 0, across trials
  std::int64_t frame = 0;  ///< index in the log
  int trial = 0;
  StoredSurface surface;
  StoredReference reference;
  /// In the first frame of its trial, as tracked. Identity of a keyframe that was read from a session: the
  /// scan goes on with another trial.
  Pose trial_T_keyframe = Pose::Identity();
};

/// How a keyframe is linked to an earlier one of the same trial: that which it was registered to.
struct KeyframeLink {
  std::shared_ptr<const Keyframe> previous;  ///< null at the start of a trial
  Pose previous_T_this = Pose::Identity();
  Matrix6d information = Matrix6d::Zero();  ///< of the right perturbation of previous_T_this
  /// of what both show, in this keyframe's frame
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();
  Vector6d membrane_bias = Vector6d::Zero();  ///< RegistrationResult::membrane_bias, of previous_T_this
};

/// How a frame is linked to the keyframe it was registered to.
KeyframeLink link_to(const std::shared_ptr<const Keyframe>& keyframe, const RegistrationResult& registration);

/// A keyframe as the tracker hands it out.
struct NewKeyframe {
  std::shared_ptr<const Keyframe> keyframe;
  KeyframeLink link;
};

}  // namespace gelslam
