#include <open3d/pipelines/registration/Feature.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/utility/Random.h>

#include "open3d_icp.hpp"

namespace gelslam {
namespace {

using namespace baselines::detail;
namespace o3d = open3d::pipelines::registration;

/// A point cloud with a feature histogram for every point; null if it has too few points.
struct DescribedCloud {
  open3d::geometry::PointCloud cloud;
  std::shared_ptr<o3d::Feature> features;
};

DescribedCloud describe_cloud(const Surface& surface, const FpfhOptions& options) {
  DescribedCloud described{to_cloud(contact_points(surface, options.max_points)), nullptr};
  if (described.cloud.points_.size() < kMinPoints) return described;
  const SingleThread guard;
  described.features = o3d::ComputeFPFHFeature(
      described.cloud,
      open3d::geometry::KDTreeSearchParamHybrid(options.feature_radius_mm, options.feature_neighbors));
  return described;
}

Pose align_by_features(const DescribedCloud& reference, const DescribedCloud& target, const Pose& initial,
                       const FpfhOptions& options) {
  const SingleThread guard;
  open3d::utility::random::Seed(options.seed);
  const o3d::CorrespondenceCheckerBasedOnEdgeLength edge_lengths(options.edge_length_ratio);
  const o3d::CorrespondenceCheckerBasedOnDistance distances(options.max_distance_mm);
  const o3d::RegistrationResult rough = o3d::RegistrationRANSACBasedOnFeatureMatching(
      reference.cloud, target.cloud, *reference.features, *target.features, false, options.max_distance_mm,
      o3d::TransformationEstimationPointToPoint(false), options.ransac_points, {edge_lengths, distances},
      o3d::RANSACConvergenceCriteria(options.ransac_iterations, 0.999));
  return align_by_icp(reference.cloud, target.cloud, to_pose(rough.transformation_, initial),
                      options.refinement);
}

class Fpfh {
 public:
  Fpfh(const Surface& reference, const FpfhOptions& options)
      : options_(options), cloud_(describe_cloud(reference, options)) {}

  Pose align(const Surface& target, const Pose& initial) const {
    const DescribedCloud target_cloud = describe_cloud(target, options_);
    return cloud_.features && target_cloud.features
               ? align_by_features(cloud_, target_cloud, initial, options_)
               : initial;
  }

 private:
  FpfhOptions options_;
  DescribedCloud cloud_;
};

}  // namespace

Registrar make_fpfh(const FpfhOptions& options, const NormalFlowOptions& judged_by) {
  return baseline_registrar<Fpfh>(options, judged_by);
}

}  // namespace gelslam
