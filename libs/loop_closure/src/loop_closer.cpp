#include "gelslam/loop_closure/loop_closer.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/loop_closure/self_similarity.hpp"
#include "gelslam/registration/overlap_agreement.hpp"
#include "place_alignment.hpp"
#include "place_features.hpp"
#include "place_index.hpp"

namespace gelslam {
namespace {

using namespace loop_closure::detail;

struct Place {
  Keyframe keyframe;
  PlaceFeatures features;
};

struct Candidate {
  const Place* place;
  std::vector<Match> inliers;
};

}  // namespace

struct LoopCloser::Impl {
  LoopClosureOptions options;
  std::vector<Place> places;
  PlaceIndex index;

  std::size_t neighbors(const Keyframe& keyframe) const;
  std::optional<LoopConstraint> register_and_check(const Keyframe& older, const NormalFlowReference& newer,
                                                   const Pose& older_T_newer_guess) const;
  bool shows_all_of(const Keyframe& older, const NormalFlowReference& newer,
                    const RegistrationResult& result) const;
  std::vector<Candidate> compare(const PlaceFeatures& features, const std::vector<int>& with) const;
  std::vector<LoopConstraint> search(const PlaceFeatures& features, const NormalFlowReference& newer,
                                     const std::vector<int>& among, int wanted) const;
};

// How many of the newest places are the same touch going on: compared without a vote, and counted apart, or
// else they would crowd out the places that were left and found again.
std::size_t LoopCloser::Impl::neighbors(const Keyframe& keyframe) const {
  constexpr std::size_t kMostNeighbors = 12;
  std::size_t count = 0;
  while (count < std::min(kMostNeighbors, places.size()) &&
         places[places.size() - 1 - count].keyframe.trial == keyframe.trial)
    ++count;
  return count;
}

// The newer keyframe is the registration's reference: then the result is older_T_newer with its information
// in the newer's axes, just as a constraint states it, and nothing has to be transported by an adjoint.
std::optional<LoopConstraint> LoopCloser::Impl::register_and_check(const Keyframe& older,
                                                                   const NormalFlowReference& newer,
                                                                   const Pose& older_T_newer_guess) const {
  const RegistrationResult result =
      register_normal_flow(newer, *older.surface, older_T_newer_guess, options.registration);
  if (!result.ok() && !shows_all_of(older, newer, result)) return std::nullopt;
  const OverlapAgreement overlap =
      compare_overlap(*older.surface, newer.surface(), result.target_T_reference);
  if (overlap.texture_correlation < options.min_texture_correlation ||
      overlap.height_rmse_mm > options.max_height_rmse_mm ||
      overlap.free_space_violation > options.max_free_space_violation)
    return std::nullopt;
  LoopConstraint loop;
  loop.from = older.id;
  loop.to = -1;
  loop.from_T_to = result.target_T_reference;
  loop.information = result.information;
  loop.shared_center_mm = result.shared_center_mm;
  loop.scr = result.scr;
  loop.ccs = result.ccs;
  loop.texture_correlation = overlap.texture_correlation;
  loop.height_rmse_mm = overlap.height_rmse_mm;
  loop.free_space_violation = overlap.free_space_violation;
  loop.tentative = overlap.texture_correlation < options.sure_texture_correlation;
  return loop;
}

// SCR asks how much of the newer contact is found again. An older one that is small, a first touch or a last
// one, may lie in it with all it has: then the question is put the other way round.
bool LoopCloser::Impl::shows_all_of(const Keyframe& older, const NormalFlowReference& newer,
                                    const RegistrationResult& result) const {
  return result.status == RegistrationStatus::too_little_overlap && older.reference &&
         older.surface->contact_pixels < newer.surface().contact_pixels &&
         judge_pose(*older.reference, newer.surface(), result.target_T_reference.inverse(),
                    options.registration)
             .ok();
}

// Those places that share enough features in one rigid arrangement, most alike first.
std::vector<Candidate> LoopCloser::Impl::compare(const PlaceFeatures& features,
                                                 const std::vector<int>& with) const {
  std::vector<Candidate> result;
  if (features.size() < options.min_sift_inliers) return result;
  for (const int i : with) {
    const Place& place = places[static_cast<std::size_t>(i)];
    Candidate candidate{&place,
                        rigid_inliers(place.features, features,
                                      match_features(place.features, features, options.max_match_ratio),
                                      options.ransac_threshold_px, options.ransac_iterations)};
    if (static_cast<int>(candidate.inliers.size()) >= options.min_sift_inliers)
      result.push_back(std::move(candidate));
  }
  std::stable_sort(result.begin(), result.end(), [](const Candidate& a, const Candidate& b) {
    return a.inliers.size() > b.inliers.size();
  });
  return result;
}

std::vector<LoopConstraint> LoopCloser::Impl::search(const PlaceFeatures& features,
                                                     const NormalFlowReference& newer,
                                                     const std::vector<int>& among, int wanted) const {
  std::vector<LoopConstraint> loops;
  const std::vector<Candidate> candidates = compare(features, among);
  if (candidates.empty() || self_similarity(newer.surface()) > options.max_self_similarity) return loops;
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(loops.size()) >= wanted) break;
    const Keyframe& older = candidate.place->keyframe;
    const std::optional<Pose> guess =
        lift(*older.surface, newer.surface(), candidate.place->features, features, candidate.inliers);
    std::optional<LoopConstraint> loop = guess ? register_and_check(older, newer, *guess) : std::nullopt;
    if (!loop) continue;
    loop->sift_inliers = static_cast<int>(candidate.inliers.size());
    loops.push_back(*loop);
  }
  return loops;
}

LoopCloser::LoopCloser(const LoopClosureOptions& options) : impl_(std::make_unique<Impl>()) {
  if (options.min_sift_inliers < 3 || options.max_features < options.min_sift_inliers ||
      !(options.ransac_threshold_px > 0))
    throw Error(
        "loop closure: min_sift_inliers must be at least 3 and at most max_features, ransac_threshold_px "
        "above 0");
  impl_->options = options;
}

LoopCloser::~LoopCloser() = default;

std::vector<LoopConstraint> LoopCloser::add(const Keyframe& keyframe) {
  std::vector<Place>& places = impl_->places;
  if (!places.empty() && keyframe.id <= places.back().keyframe.id)
    throw Error("loop closure: keyframe " + std::to_string(keyframe.id) + " comes after " +
                std::to_string(places.back().keyframe.id) + "; ids must grow");
  const PlaceFeatures features = extract_features(*keyframe.surface, impl_->options);
  const std::size_t neighbors = impl_->neighbors(keyframe), elsewhere = places.size() - neighbors;

  std::vector<LoopConstraint> loops = impl_->search(
      features, *keyframe.reference,
      impl_->index.most_alike(features, static_cast<int>(elsewhere), impl_->options.max_candidates),
      impl_->options.max_constraints);
  // The predecessor is linked by odometry already, from the same pixels: a loop to it would count them twice.
  std::vector<int> before_predecessor(neighbors > 0 ? neighbors - 1 : 0);
  std::iota(before_predecessor.begin(), before_predecessor.end(), static_cast<int>(elsewhere));
  const std::vector<LoopConstraint> near = impl_->search(features, *keyframe.reference, before_predecessor,
                                                         impl_->options.max_neighbor_constraints);
  loops.insert(loops.end(), near.begin(), near.end());
  for (LoopConstraint& loop : loops) loop.to = keyframe.id;

  impl_->index.add(features);
  places.push_back({keyframe, features});
  return loops;
}

void LoopCloser::forget_from(int keyframe_id) {
  std::vector<Place>& places = impl_->places;
  while (!places.empty() && places.back().keyframe.id >= keyframe_id) places.pop_back();
  impl_->index.truncate(static_cast<int>(places.size()));
}

std::optional<LoopConstraint> LoopCloser::verify(const Keyframe& older, const Keyframe& newer,
                                                 const Pose& older_T_newer_guess) const {
  std::optional<LoopConstraint> loop =
      impl_->register_and_check(older, *newer.reference, older_T_newer_guess);
  if (loop) loop->to = newer.id;
  return loop;
}

}  // namespace gelslam
