#pragma once

#include <filesystem>
#include <opencv2/core/types.hpp>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::bench {

/// Which frames of a sequence become registration problems: from every `stride`-th frame on, the frames that
/// lie `gaps` later, as long as both touch.
struct ProblemChoice {
  int stride = 60;
  std::vector<int> gaps = {1, 5, 12};
};

struct RegistrationProblem {
  std::size_t reference = 0;  ///< index into ProblemSet::references
  SurfacePtr target;
  Pose start =
      Pose::Identity();  ///< true target_T_reference of the frame before: what tracking would start from
  Pose truth = Pose::Identity();  ///< target_T_reference
};

/// The problems of one data folder at one resolution.
struct ProblemSet {
  std::vector<SurfacePtr> references;
  std::vector<RegistrationProblem> problems;
  std::vector<double> surface_ms;  ///< processor time of picture to surface, per frame used
};

/// Pictures are resized to `size` before anything looks at them, background included. Throws Error.
ProblemSet load_problems(const std::filesystem::path& folder, cv::Size size, const ProblemChoice& choice);

/// Processor time of this thread: other programs on the machine hardly show in it.
double thread_cpu_ms();

}  // namespace gelslam::bench
