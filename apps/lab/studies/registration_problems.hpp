#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::lab {

/// Which frames of a sequence become registration problems: from every `stride`-th frame on, the frames that
/// lie `gaps` later, as long as both touch.
struct ProblemChoice {
  int stride = 60;
  std::vector<int> gaps = {1, 5, 12};
  /// The frames between went missing: tracking starts from where it last saw the object, the reference's
  /// pose.
  bool frames_missing = false;
  int most_references = 1 << 20;  ///< of a long sequence only so many, evenly
};

struct RegistrationProblem {
  std::size_t reference = 0;  ///< index into ProblemSet::references
  SurfacePtr target;
  /// true target_T_reference of the frame before: what tracking would start from
  Pose start = Pose::Identity();
  Pose truth = Pose::Identity();  ///< target_T_reference
  int gap = 0;                    ///< frames from reference to target, of a sequence
  int start_number = 0;           ///< counts the starts that one pair of surfaces is tried from
};

/// The problems of one data folder.
struct ProblemSet {
  std::vector<SurfacePtr> references;
  std::vector<RegistrationProblem> problems;
};

/// Throws Error.
ProblemSet load_problems(const std::filesystem::path& folder, const ProblemChoice& choice);

}  // namespace gelslam::lab
