#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "judgement.hpp"
#include "stability_levels.hpp"

namespace gelslam::lab {

/// What one method said to one problem.
struct Answer {
  std::string source;  ///< "generated", "frame 0" or "keyframes"
  std::string where;   ///< the chart of a generated problem, or the sequence
  std::string name;    ///< of the problem: "pebble, place 2", "frame 17"
  std::string method;
  double scr = 0, ccs = 0;
  Judgement judgement;
};

/// Every method's answer to every problem of a level. FPFH, which needs no start and much time, answers once
/// for every second pair of surfaces, and nothing about starts. Methods by name, as make_registrar knows
/// them; throws Error for others.
std::vector<Answer> answers_to(const StabilityLevel& level, const std::vector<std::string>& methods);

/// The first `most_frames` frames of a sequence, against the first in contact (from the last estimate,
/// without gates; FPFH every 20th frame), and with keyframes (not FPFH). With keyframes the pose since the
/// trial's start is judged: what a person sees. What is called lost there is right if its pose fits to the
/// keyframe or to the frame before. Throws Error.
std::vector<Answer> answers_to(const std::filesystem::path& folder, int most_frames,
                               const std::vector<std::string>& methods);

}  // namespace gelslam::lab
