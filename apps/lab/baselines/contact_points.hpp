#pragma once

#include <Eigen/Core>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "gelslam/registration/registrar.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::baselines::detail {

/// Points of a contact in mm and their unit normals, in the sensor's frame.
struct ContactPoints {
  std::vector<Eigen::Vector3d> position_mm, normal;

  std::size_t size() const { return position_mm.size(); }
};

/// Fewer points than this are no surface to register.
inline constexpr std::size_t kMinPoints = 10;

/// At most `max_points` of the contact's pixels, spread evenly over them in raster order.
ContactPoints contact_points(const Surface& surface, int max_points);

/// A method behind the interface of registration, judged as NormalFlow with these limits. `Method` is made of
/// a reference and its options; align() finds the pose of a target.
template <class Method, class Options>
class BaselineRegistrar final : public Registrar {
 public:
  BaselineRegistrar(std::string_view name, const Options& options, const NormalFlowOptions& judged_by)
      : name_(name), options_(options), judged_by_(judged_by) {}
  std::string_view name() const override { return name_; }
  std::shared_ptr<const PreparedReference> prepare(SurfacePtr reference) const override {
    auto samples = std::make_shared<const NormalFlowReference>(std::move(reference), judged_by_);
    return std::make_shared<const Prepared>(std::move(samples), options_, judged_by_);
  }

 private:
  struct Prepared final : PreparedReference {
    Prepared(std::shared_ptr<const NormalFlowReference> reference, const Options& options,
             const NormalFlowOptions& limits)
        : PreparedReference(std::move(reference)), method(samples()->surface(), options), judged_by(limits) {}
    RegistrationResult register_to(const Surface& target, const PosePrior& prior) const override {
      return judge_pose(*samples(), target, method.align(target, prior.pose), judged_by);
    }
    const Method method;
    const NormalFlowOptions judged_by;
  };

  std::string_view name_;
  Options options_;
  NormalFlowOptions judged_by_;
};

}  // namespace gelslam::baselines::detail
