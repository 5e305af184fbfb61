#pragma once

#include <functional>
#include <memory>

#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

/// A surface made ready for others to be registered to it. Immutable, shareable between threads.
struct PreparedReference {
  /// Every method's result is judged by these samples (judge_pose), and loop closure goes on with them.
  std::shared_ptr<const NormalFlowReference> samples;
  /// Registers a target from the prior's pose, where the method uses a start at all. Never throws on weak
  /// data: the result's status says what happened.
  std::function<RegistrationResult(const Surface& target, const PosePrior& prior)> register_to;
};

/// A method that finds the pose between two surfaces, with its settings: does everything that depends on the
/// reference alone, once per keyframe.
using Registrar = std::function<PreparedReference(SurfacePtr reference)>;

Registrar make_normal_flow(const NormalFlowOptions& options);

}  // namespace gelslam
