#include "gelslam/registration/registration.hpp"

#include <utility>

#include "gelslam/registration/registrar.hpp"

namespace gelslam {

Matrix6d unknown_pose_covariance() {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(1 / (kMmPerRad * kMmPerRad)), Eigen::Vector3d::Ones();
  return (kMinPeriodMm * kMinPeriodMm * variance).asDiagonal();
}

PosePrior::PosePrior(const UncertainPose& target_T_reference)
    : PosePrior(target_T_reference, target_T_reference.covariance + unknown_pose_covariance()) {
  // The standard deviation of a usual motion is a tenth of that of an unknown pose.
  constexpr double kUsualMotion2 = 0.01;
  covariance += kUsualMotion2 * unknown_pose_covariance();
}

std::string_view describe(RegistrationStatus status) {
  constexpr std::string_view sentences[] = {"tracked",
                                            "too little overlap",
                                            "the surfaces do not match",
                                            "the alignment diverged",
                                            "the object would lie in untouched gel",
                                            "it fits at several places",
                                            "too little contact"};
  return sentences[static_cast<std::size_t>(status)];
}

std::string describe_observability(const std::array<bool, 6>& observable) {
  constexpr std::array<std::string_view, 6> motions = {"sliding along x", "sliding along y", "moving along z",
                                                       "tilting about x", "tilting about y", "twisting"};
  std::string hidden;
  int count = 0;
  for (std::size_t axis = 0; axis < motions.size(); ++axis) {
    if (observable[axis]) continue;
    hidden += (count++ == 0 ? "" : ", ") + std::string(motions[axis]);
  }
  if (count == 0) return "";
  return hidden + (count == 1 ? " is" : " are") + " not observable";
}

Registrar make_normal_flow(const NormalFlowOptions& options) {
  return [options](SurfacePtr surface) {
    const auto samples = std::make_shared<const NormalFlowReference>(std::move(surface), options);
    return PreparedReference{samples, [=](const Surface& target, const PosePrior& prior) {
                               return register_normal_flow(*samples, target, prior, options);
                             }};
  };
}

}  // namespace gelslam
