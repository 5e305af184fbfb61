#include <utility>

#include "gelslam/registration/registrar.hpp"

namespace gelslam {
namespace {

class PreparedNormalFlow final : public PreparedReference {
 public:
  PreparedNormalFlow(std::shared_ptr<const NormalFlowReference> samples, const NormalFlowOptions& options)
      : PreparedReference(std::move(samples)), options_(options) {}

  RegistrationResult register_to(const Surface& target, const Pose& initial) const override {
    return register_normal_flow(*samples(), target, initial, options_);
  }

 private:
  NormalFlowOptions options_;
};

class NormalFlowRegistrar final : public Registrar {
 public:
  explicit NormalFlowRegistrar(const NormalFlowOptions& options) : options_(options) {}

  std::string_view name() const override { return "normalflow"; }
  std::shared_ptr<const PreparedReference> prepare(SurfacePtr reference) const override {
    return std::make_shared<const PreparedNormalFlow>(
        std::make_shared<const NormalFlowReference>(std::move(reference), options_), options_);
  }

 private:
  NormalFlowOptions options_;
};

}  // namespace

std::shared_ptr<const Registrar> make_normal_flow(const NormalFlowOptions& options) {
  return std::make_shared<const NormalFlowRegistrar>(options);
}

}  // namespace gelslam
