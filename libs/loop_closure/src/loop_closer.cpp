// Finds earlier keyframes that show the same place as a new one (Huang, Mirzaee, Kaess, Yuan, GelSLAM, T-RO
// 2026, section V).
//
// SIFT features (Lowe 2004) of the curvature map inside the contact vote for keyframes by local naive Bayes
// nearest neighbors (PlaceIndex; McCann & Lowe 2012). The max_candidates keyframes with most votes are
// compared with the new one feature by feature: mutual nearest neighbors that pass the ratio test, then
// RANSAC for one rotation and shift in the image. A match with at least min_sift_inliers inliers is lifted to
// a pose in 3-D by points and normals (lift()), from which verify_loop() registers the two surfaces and
// verifies the result. At most max_constraints verified loops become edges.
//
// The newest keyframes of the same trial do not take part, as odometry links them already. Limitations:
// smooth surfaces have no features and are never recognized. Repeated patterns fail the ratio test; where
// they pass it, they give several poses, of which verify_registered() and loop_layers.cpp have to reject the
// wrong ones.

#include "gelslam/loop_closure/loop_closer.hpp"

#include <algorithm>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/parallel.hpp"
#include "place_features.hpp"
#include "place_index.hpp"

namespace gelslam {

namespace loop_closure::detail {

// Ratio test: the largest allowed distance of a match relative to that of the second best. Features of
// repeated patterns fail it.
constexpr double kMaxMatchRatio = 0.9;
// Larger than the error of a feature's position, on any texture.
constexpr double kRansacThresholdMm = 0.19;
constexpr int kRansacIterations = 100;

struct Candidate {
  const Keyframe* older;
  RigidMotion older_T_newer;
};

}  // namespace loop_closure::detail

using namespace loop_closure::detail;

struct LoopCloser::Impl {
  LoopClosureOptions options;
  NormalFlowOptions registration;
  VerificationOptions verification;
  std::vector<Keyframe> places;
  PlaceIndex index;  // Features of `places`, in the same order.

  std::size_t neighbors(const Keyframe& keyframe) const;
  std::vector<Candidate> compare(const PlaceFeatures& features, const std::vector<int>& with) const;
  std::vector<PoseGraphEdge> search(const PlaceFeatures& features, const Keyframe& newer,
                                    const std::vector<int>& among, int wanted) const;
  void keep(const Keyframe& keyframe, PlaceFeatures features);
};

/// Returns how many of the newest stored keyframes are neighbors of the new one in the same trial. They look
/// alike because they overlap, so their votes would crowd out keyframes of places that the sensor left and
/// came back to.
std::size_t LoopCloser::Impl::neighbors(const Keyframe& keyframe) const {
  constexpr std::size_t kMaxNeighbors = 12;
  std::size_t count = 0;
  while (count < std::min(kMaxNeighbors, places.size()) &&
         places[places.size() - 1 - count].trial == keyframe.trial)
    ++count;
  return count;
}

/// Returns the keyframes that share at least min_sift_inliers features in one rigid arrangement, those with
/// most inliers first.
std::vector<Candidate> LoopCloser::Impl::compare(const PlaceFeatures& features,
                                                 const std::vector<int>& with) const {
  std::vector<Candidate> result;
  if (features.size() < options.min_sift_inliers) return result;
  for (const int i : with) {
    const PlaceFeatures& older = index.features(i);
    const Keyframe& place = places[static_cast<std::size_t>(i)];
    const double threshold_px = kRansacThresholdMm / place.surface.facts().pixel_pitch_mm;
    Candidate candidate{
        &place, align_rigidly(older, features, match_features(older, features, kMaxMatchRatio), threshold_px,
                              kRansacIterations)};
    if (candidate.older_T_newer.inliers >= options.min_sift_inliers) result.push_back(std::move(candidate));
  }
  std::stable_sort(result.begin(), result.end(), [](const Candidate& a, const Candidate& b) {
    return a.older_T_newer.inliers > b.older_T_newer.inliers;
  });
  return result;
}

std::vector<PoseGraphEdge> LoopCloser::Impl::search(const PlaceFeatures& features, const Keyframe& newer,
                                                    const std::vector<int>& among, int wanted) const {
  std::vector<PoseGraphEdge> loops;
  for (const Candidate& candidate : compare(features, among)) {
    if (static_cast<int>(loops.size()) >= wanted) break;
    const Keyframe& older = *candidate.older;
    const Pose older_T_newer = lift(*older.surface.get(), *newer.surface.get(), candidate.older_T_newer);
    const auto loop = verify_loop(older, newer, older_T_newer, registration, verification);
    if (loop) loops.push_back(*loop);
  }
  return loops;
}

void LoopCloser::Impl::keep(const Keyframe& keyframe, PlaceFeatures features) {
  if (!places.empty() && keyframe.id <= places.back().id)
    throw Error("loop closure: keyframe " + std::to_string(keyframe.id) + " comes after " +
                std::to_string(places.back().id) + "; ids must grow");
  index.add(std::move(features));
  places.push_back(keyframe);
}

// The newer keyframe is the reference of the registration. The result is then older_T_newer, with the
// information along the axes of the newer keyframe, as PoseGraphEdge requires.
std::optional<PoseGraphEdge> verify_loop(const Keyframe& older, const Keyframe& newer,
                                         const Pose& older_T_newer, const NormalFlowOptions& registration,
                                         const VerificationOptions& verification) {
  const RegistrationResult result = verify(*newer.reference.get(), *older.reference.get(), {older_T_newer},
                                           PlacePrior::loop_candidate, registration, verification);
  if (!result.ok()) return std::nullopt;
  return PoseGraphEdge{older.id,
                       newer.id,
                       result.target_T_reference,
                       symmetric(result.information),
                       EdgeKind::loop,
                       result.shared_center_mm,
                       result.texture_correlation < verification.sure_texture_correlation};
}

LoopCloser::LoopCloser(const LoopClosureOptions& options, const NormalFlowOptions& registration,
                       const VerificationOptions& verification)
    : impl_(std::make_unique<Impl>()) {
  if (options.min_sift_inliers < 3 || options.max_features < options.min_sift_inliers)
    throw Error("loop closure: min_sift_inliers must be at least 3 and at most max_features");
  impl_->options = options;
  impl_->registration = registration;
  impl_->verification = verification;
}

LoopCloser::~LoopCloser() = default;

std::vector<PoseGraphEdge> LoopCloser::add(const Keyframe& keyframe) {
  PlaceFeatures features = extract_features(*keyframe.surface.get(), impl_->options);
  const std::size_t elsewhere = impl_->places.size() - impl_->neighbors(keyframe);
  std::vector<PoseGraphEdge> loops = impl_->search(
      features, keyframe,
      impl_->index.most_alike(features, static_cast<int>(elsewhere), impl_->options.max_candidates),
      impl_->options.max_constraints);
  impl_->keep(keyframe, std::move(features));
  return loops;
}

void LoopCloser::keep(const std::vector<Keyframe>& keyframes) {
  std::vector<PlaceFeatures> features(keyframes.size());
  parallel_for(keyframes.size(), 0, [&](std::size_t i) {
    features[i] = extract_features(*keyframes[i].surface.get(), impl_->options);
  });
  for (std::size_t i = 0; i < keyframes.size(); ++i) impl_->keep(keyframes[i], std::move(features[i]));
}

std::vector<PoseGraphEdge> LoopCloser::recognize(const Keyframe& keyframe) const {
  const PlaceFeatures features = extract_features(*keyframe.surface.get(), impl_->options);
  const int count = static_cast<int>(impl_->places.size()), most = impl_->options.max_candidates;
  return impl_->search(features, keyframe, impl_->index.most_alike(features, count, most), most);
}

}  // namespace gelslam
