#include "gelslam/frontend/keyframe.hpp"

namespace gelslam {
namespace {

/// Information of the inverse pose: true = T * exp(noise) <=> true^-1 = T^-1 * exp(Ad(T) * -noise).
Matrix6d information_of_inverse(const Matrix6d& information, const Pose& pose) {
  const Matrix6d from = adjoint(pose.inverse());
  return from.transpose() * information * from;
}

}  // namespace

KeyframeLink link_to(const std::shared_ptr<const Keyframe>& keyframe,
                     const RegistrationResult& registration) {
  const Pose& frame_T_keyframe = registration.target_T_reference;
  return {keyframe, frame_T_keyframe.inverse(),
          information_of_inverse(registration.information, frame_T_keyframe),
          frame_T_keyframe * registration.shared_center_mm};
}

}  // namespace gelslam
