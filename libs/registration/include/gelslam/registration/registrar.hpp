#pragma once

#include <functional>
#include <memory>

#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

/// A surface that is prepared as the reference of registrations. Immutable; can be shared between threads.
struct PreparedReference {
  /// The samples of the surface, with which the results of any method are judged (judge_pose) and loop
  /// closure works.
  std::shared_ptr<const NormalFlowReference> samples;
  /// Registers a target to this reference, beginning at the prior's `start` if the method needs an initial
  /// value. It does not throw if the surfaces do not determine the pose; the status of the result then says
  /// why.
  std::function<RegistrationResult(const Surface& target, const PosePrior& prior)> register_to;
};

/// A registration method with its options. Called once per keyframe, it does all computations that depend on
/// the reference alone.
using Registrar = std::function<PreparedReference(SurfacePtr reference)>;

/// Returns the method of register_normal_flow().
Registrar make_normal_flow(const NormalFlowOptions& options);

}  // namespace gelslam
