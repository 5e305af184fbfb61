#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "gelslam/registration/registrar.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::baselines::detail {

/// Points of a contact in mm with their unit normals, in the sensor's frame.
struct ContactPoints {
  std::vector<Eigen::Vector3d> position_mm, normal;

  std::size_t size() const { return position_mm.size(); }
};

/// With fewer points than this, a contact cannot be registered.
inline constexpr std::size_t kMinPoints = 10;

/// Returns at most `max_points` of the contact's pixels, spread evenly over them in raster order.
ContactPoints contact_points(const Surface& surface, int max_points);

/// Returns a method with the interface of Registrar. Its results are judged like those of NormalFlow with the
/// limits `judged_by`. A `Method` is constructed from a reference and its options; align() estimates the pose
/// of a target.
template <class Method, class Options>
Registrar baseline_registrar(const Options& options, const NormalFlowOptions& judged_by) {
  return [=](SurfacePtr reference) {
    const auto samples = std::make_shared<const NormalFlowReference>(std::move(reference), judged_by);
    const auto method = std::make_shared<const Method>(samples->surface(), options);
    return PreparedReference{samples, [=](const Surface& target, const PosePrior& prior) {
                               return judge_pose(*samples, target, method->align(target, prior.pose),
                                                 judged_by);
                             }};
  };
}

}  // namespace gelslam::baselines::detail
