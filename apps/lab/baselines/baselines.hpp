#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gelslam/registration/registrar.hpp"

namespace gelslam {

/// Registration methods with which NormalFlow (Huang et al., RA-L 2024) is compared, with the same interface.
/// Each one aligns the points of both contacts; the defaults are the settings published there, as far as they
/// are known. All run on one thread and give identical results for the same input. All six axes of the pose
/// come from the method alone; the result is judged by judge_pose() with `judged_by`.

/// Point-to-plane ICP (Chen & Medioni 1992), implementation of Open3D.
struct IcpOptions {
  int max_points = 5000;  ///< For each contact, spread evenly over it.
  /// Largest distance of corresponding points; the default allows anything on the sensor.
  double max_distance_mm = 100.0;
  int max_iterations = 30;
  double relative_tolerance = 1e-6;  ///< Relative to fitness and root mean square distance.
};

/// Fast point feature histograms (Rusu 2009), matched by RANSAC without an initial pose, followed by ICP;
/// implementation of Open3D.
struct FpfhOptions {
  int max_points = 5000;
  double feature_radius_mm = 1.0;
  int feature_neighbors = 100;
  int ransac_iterations = 10000;
  int ransac_points = 4;
  double edge_length_ratio = 0.9;
  double max_distance_mm = 1.0;
  int seed = 1;
  IcpOptions refinement = {};  ///< Its max_points is not used.
};

/// FilterReg, point to plane (Gao & Tedrake, CVPR 2019): expectation maximization in which the target's
/// points are the centers of a Gaussian mixture. The expectation is computed by filtering the target once,
/// and evaluated at the reference's points. Implemented here from the paper's equations, on a regular grid.
struct FilterRegOptions {
  int max_points = 5000;
  double variance_mm2 = 0.01;   ///< Variance of the Gaussians, which is not changed; at least 0.0025.
  double tolerance_mm2 = 1e-5;  ///< Iterations end when the mean squared distance changes by less.
  int max_iterations = 50;
  /// Fraction of the reference's points without a corresponding point, 0 to below 1.
  double outlier_share = 0.0;
};

Registrar make_icp(const IcpOptions& options, const NormalFlowOptions& judged_by = {});
Registrar make_fpfh(const FpfhOptions& options, const NormalFlowOptions& judged_by = {});
Registrar make_filter_reg(const FilterRegOptions& options, const NormalFlowOptions& judged_by = {});

/// Return the best settings found for each method (docs/results.md).
IcpOptions tuned_icp();
FpfhOptions tuned_fpfh();
FilterRegOptions tuned_filter_reg();

/// Returns the names of all methods on the command line: normalflow, icp, fpfh, filterreg with published
/// settings, and icp-tuned, fpfh-tuned, filterreg-tuned.
const std::vector<std::string>& registrar_names();

/// `options` are the settings of NormalFlow, by which the results of the other methods are judged, too.
/// Throws Error that names the nearest known method.
Registrar make_registrar(std::string_view name, const NormalFlowOptions& options);

namespace baselines::detail {

/// While it exists, Open3D prints nothing, and OpenMP on this thread runs every parallel region with one
/// thread, even those that request as many as there are cores, as Open3D does. Times are then comparable with
/// single-threaded methods, sums have a fixed order, and RANSAC draws the same numbers.
class SingleThread {
 public:
  SingleThread();
  ~SingleThread();
  SingleThread(const SingleThread&) = delete;
  SingleThread& operator=(const SingleThread&) = delete;

 private:
  int levels_before_, verbosity_before_;
};

}  // namespace baselines::detail
}  // namespace gelslam
