#include <utility>

#include "open3d_icp.hpp"

namespace gelslam {
namespace {

using namespace baselines::detail;

class PreparedIcp final : public PreparedReference {
 public:
  PreparedIcp(std::shared_ptr<const NormalFlowReference> samples, const IcpOptions& options)
      : PreparedReference(std::move(samples)),
        options_(options),
        cloud_(to_cloud(contact_points(this->samples()->surface(), options.max_points))) {}

  RegistrationResult register_to(const Surface& target, const PosePrior& prior) const override {
    const open3d::geometry::PointCloud target_cloud = to_cloud(contact_points(target, options_.max_points));
    Pose found = prior.target_T_reference;
    if (cloud_.points_.size() >= kMinPoints && target_cloud.points_.size() >= kMinPoints) {
      const QuietSingleThread guard;
      found = align_by_icp(cloud_, target_cloud, prior.target_T_reference, options_);
    }
    return judge_pose(*samples(), target, found, options_.judged_by);
  }

 private:
  IcpOptions options_;
  open3d::geometry::PointCloud cloud_;
};

class IcpRegistrar final : public Registrar {
 public:
  explicit IcpRegistrar(const IcpOptions& options) : options_(options) {}
  std::string_view name() const override { return "icp"; }
  std::shared_ptr<const PreparedReference> prepare(SurfacePtr reference) const override {
    auto samples = std::make_shared<const NormalFlowReference>(std::move(reference), options_.judged_by);
    return std::make_shared<const PreparedIcp>(std::move(samples), options_);
  }

 private:
  IcpOptions options_;
};

}  // namespace

std::shared_ptr<const Registrar> make_icp(const IcpOptions& options) {
  return std::make_shared<const IcpRegistrar>(options);
}

}  // namespace gelslam
