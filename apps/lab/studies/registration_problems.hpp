#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::lab {

/// Selects the registration problems of a sequence: every `stride`-th frame is a reference, and the frames
/// `gaps` later are its targets, if both have contact.
struct ProblemChoice {
  int stride = 60;
  std::vector<int> gaps = {1, 5, 12};
  /// If true, the frames in between count as missing: tracking starts from its last known pose, that of the
  /// reference.
  bool frames_missing = false;
  /// For a long sequence, at most this many references are used, evenly spaced.
  int most_references = 1 << 20;
};

struct RegistrationProblem {
  std::size_t reference = 0;  ///< Index into ProblemSet::references.
  SurfacePtr target;
  /// True target_T_reference of the previous frame, from which tracking would start.
  Pose start = Pose::Identity();
  Pose truth = Pose::Identity();  ///< target_T_reference
  int gap = 0;                    ///< Number of frames from reference to target in a sequence.
  int start_number = 0;           ///< Number of the start among those tried for one pair of surfaces.
};

/// The registration problems of one data folder.
struct ProblemSet {
  std::vector<SurfacePtr> references;
  std::vector<RegistrationProblem> problems;
};

/// Throws Error.
ProblemSet load_problems(const std::filesystem::path& folder, const ProblemChoice& choice);

}  // namespace gelslam::lab
