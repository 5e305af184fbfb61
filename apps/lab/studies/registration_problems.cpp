#include "registration_problems.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/slam/surface_stream.hpp"

namespace gelslam::lab {
namespace {

struct Pair {
  int reference, target;  // Indices of the truth.
};

std::vector<Pair> choose_pairs(const GroundTruth& truth, const ProblemChoice& choice) {
  const int count = static_cast<int>(truth.start_T_currs.size());
  const auto touches = [&](int i) { return truth.start_T_currs[static_cast<std::size_t>(i)].has_value(); };
  const int stride = std::max(choice.stride, count / choice.most_references);
  std::vector<Pair> pairs;
  for (int reference = stride / 2; reference < count; reference += stride)
    for (const int gap : choice.gaps)
      if (const int target = reference + gap;
          target < count && touches(reference) && touches(target) && touches(target - 1))
        pairs.push_back({reference, target});
  return pairs;
}

/// Returns the surfaces of the frames at the given indices of the truth.
std::map<int, SurfacePtr> surfaces_of(const std::filesystem::path& folder, const GroundTruth& truth,
                                      const std::set<int>& wanted) {
  const LogInput input{folder, {}, {}, {}, false};
  StageTimer timer;
  SurfaceStream stream(input, resolve_config(input), timer);
  std::map<int, SurfacePtr> surfaces;
  while (std::optional<SurfaceStream::Item> item = stream.next()) {
    const int index = static_cast<int>(item->image.index) - truth.background_frames;
    if (wanted.empty() || index > *wanted.rbegin()) break;
    if (item->surface && wanted.contains(index)) surfaces[index] = std::move(item->surface);
  }
  return surfaces;
}

}  // namespace

ProblemSet load_problems(const std::filesystem::path& folder, const ProblemChoice& choice) {
  const GroundTruth truth = read_ground_truth(folder);
  const std::vector<Pair> pairs = choose_pairs(truth, choice);
  std::set<int> wanted;
  for (const Pair& pair : pairs) wanted.insert({pair.reference, pair.target});
  ProblemSet set;
  const std::map<int, SurfacePtr> surfaces = surfaces_of(folder, truth, wanted);
  const auto pose = [&](int index) { return *truth.start_T_currs[static_cast<std::size_t>(index)]; };
  int reference = -1;
  for (const Pair& pair : pairs) {
    if (!surfaces.contains(pair.target)) continue;
    if (pair.reference != reference) {
      reference = pair.reference;
      set.references.push_back(surfaces.at(reference));
    }
    RegistrationProblem problem;
    problem.reference = set.references.size() - 1;
    problem.target = surfaces.at(pair.target);
    if (!choice.frames_missing) problem.start = pose(pair.target - 1).inverse() * pose(reference);
    problem.truth = pose(pair.target).inverse() * pose(reference);
    problem.gap = pair.target - pair.reference;
    set.problems.push_back(problem);
  }
  return set;
}

}  // namespace gelslam::lab
