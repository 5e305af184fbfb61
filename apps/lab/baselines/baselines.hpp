#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gelslam/registration/registrar.hpp"

namespace gelslam {

/// The methods that NormalFlow (Huang et al., RA-L 2024) is compared with, behind the same interface. Each
/// aligns the points of both contacts; defaults are the settings published there, as far as they are. All run
/// on one thread and give the same bits for the same input. Poses come from the method alone, all six axes;
/// they are judged by judge_pose with `judged_by`.

/// Point-to-plane ICP (Chen & Medioni 1992), Open3D's.
struct IcpOptions {
  int max_points = 5000;           ///< of each contact, spread evenly over it
  double max_distance_mm = 100.0;  ///< of a point and its partner: anything on the sensor
  int max_iterations = 30;
  double relative_tolerance = 1e-6;  ///< of fitness and of the root mean square distance in mm
};

/// Fast point feature histograms (Rusu 2009), matched by RANSAC without any start, then ICP; Open3D's.
struct FpfhOptions {
  int max_points = 5000;
  double feature_radius_mm = 1.0;
  int feature_neighbors = 100;
  int ransac_iterations = 10000;
  int ransac_points = 4;
  double edge_length_ratio = 0.9;
  double max_distance_mm = 1.0;
  int seed = 1;
  IcpOptions refinement = {};  ///< its max_points is not used
};

/// FilterReg, point to plane (Gao & Tedrake, CVPR 2019): expectation-maximisation in which the target's
/// points are the centers of a Gaussian mixture, and the expectation is one filtering of the target,
/// evaluated at the reference's points. Our own, from the paper's mathematics, on a regular grid.
struct FilterRegOptions {
  int max_points = 5000;
  double variance_mm2 = 0.01;   ///< of the Gaussians; kept; from 0.0025 on
  double tolerance_mm2 = 1e-5;  ///< stop when the mean squared distance changes by less
  int max_iterations = 50;
  double outlier_share = 0.0;  ///< of the reference's points that have no partner, 0 to below 1
};

Registrar make_icp(const IcpOptions& options, const NormalFlowOptions& judged_by = {});
Registrar make_fpfh(const FpfhOptions& options, const NormalFlowOptions& judged_by = {});
Registrar make_filter_reg(const FilterRegOptions& options, const NormalFlowOptions& judged_by = {});

/// The best settings we found for each (docs/results.md).
IcpOptions tuned_icp();
FpfhOptions tuned_fpfh();
FilterRegOptions tuned_filter_reg();

/// Every method by the name it has on the command line: normalflow, icp, fpfh, filterreg with published
/// settings, and icp-tuned, fpfh-tuned, filterreg-tuned.
const std::vector<std::string>& registrar_names();

/// `options`: NormalFlow's settings, by which the others are judged. Throws Error naming the nearest known
/// method.
Registrar make_registrar(std::string_view name, const NormalFlowOptions& options);

namespace baselines::detail {

/// While it lives, Open3D says nothing, and OpenMP on this thread runs every parallel region with one thread,
/// even those that ask for as many as the machine has, as Open3D does: times are compared with methods of one
/// thread, sums come in the same order every time, and RANSAC draws the same numbers.
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
