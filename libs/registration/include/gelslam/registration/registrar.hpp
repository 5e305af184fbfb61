#pragma once

#include <memory>
#include <string_view>
#include <utility>

#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

/// A surface made ready for others to be registered to it. Immutable, shareable between threads.
class PreparedReference {
 public:
  /// `samples` are what every method's result is judged by (judge_pose), and what loop closure goes on with.
  explicit PreparedReference(std::shared_ptr<const NormalFlowReference> samples)
      : samples_(std::move(samples)) {}
  virtual ~PreparedReference() = default;

  const std::shared_ptr<const NormalFlowReference>& samples() const { return samples_; }

  /// From the prior's pose, where the method uses a start at all. Never throws on weak data: the result's
  /// status says what happened.
  virtual RegistrationResult register_to(const Surface& target, const PosePrior& prior) const = 0;

 private:
  std::shared_ptr<const NormalFlowReference> samples_;
};

/// A method that finds the pose between two surfaces, with its settings. Immutable.
class Registrar {
 public:
  virtual ~Registrar() = default;
  virtual std::string_view name() const = 0;  ///< as on the command line: "normalflow"
  /// Everything that depends on the reference alone, once per keyframe.
  virtual std::shared_ptr<const PreparedReference> prepare(SurfacePtr reference) const = 0;
};

/// NormalFlow, "normalflow".
std::shared_ptr<const Registrar> make_normal_flow(const NormalFlowOptions& options);

}  // namespace gelslam
