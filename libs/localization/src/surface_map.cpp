// A known map for localization: its keyframes with their poses, prepared for place recognition (LoopCloser)
// and registration. fit() registers a touch to that one of the nearest keyframes that shows the largest part
// of it, and verifies the result.

#include "gelslam/localization/surface_map.hpp"

#include <algorithm>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/surface/contact_overlap.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

namespace localization::detail {

constexpr int kMaxCompared = 8;  // Largest number of keyframes near a pose whose overlap is computed.

/// A keyframe of the map.
struct MapKeyframe {
  std::shared_ptr<const Keyframe> keyframe;
  Pose map_T_keyframe = Pose::Identity();
  ContactExtent extent;
};

struct Overlap {
  const MapKeyframe* place = nullptr;
  double share = 0;  // Fraction of the touch's contact that the keyframe shows.
};

MapKeyframe make_place(const PosedSurface& patch, const NormalFlowOptions& registration) {
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = patch.id;
  keyframe->surface = patch.surface;
  keyframe->reference = StoredReference(patch.surface, registration);
  return {std::move(keyframe), patch.map_T_keyframe,
          extent_of(coarse_contact_points_mm(*patch.surface.get()))};
}

}  // namespace localization::detail

using namespace localization::detail;

struct SurfaceMap::Impl {
  SlamOptions options;
  LoopCloser recognition;
  std::vector<MapKeyframe> places;

  explicit Impl(const SlamOptions& slam)
      : options(slam), recognition(slam.loop_closure, slam.registration, slam.verification) {}

  const MapKeyframe& place(int keyframe_id) const;
  Overlap most_overlapping(const Surface& touch, const Pose& map_T_sensor) const;
};

SurfaceMap::SurfaceMap(const std::vector<PosedSurface>& patches, const SlamOptions& options,
                       ProgressSink* progress) {
  auto impl = std::make_unique<Impl>(options);
  std::vector<PosedSurface> touched;
  std::copy_if(patches.begin(), patches.end(), std::back_inserter(touched), [&](const PosedSurface& patch) {
    return patch.surface.facts().contact_mm2() >= options.tracker.min_contact_mm2;
  });
  if (touched.empty()) throw Error("the map is empty: none of its keyframes shows a contact");
  impl->places.resize(touched.size());
  ParallelProgress reading(progress, "reading the map", touched.size());
  parallel_for(touched.size(), 0, [&](std::size_t i) {
    impl->places[i] = make_place(touched[i], options.registration);
    reading.step();
  });
  std::vector<Keyframe> keyframes;
  for (const MapKeyframe& place : impl->places) keyframes.push_back(*place.keyframe);
  impl->recognition.keep(keyframes);
  reading.end();
  impl_ = std::move(impl);
}

SurfaceMap::~SurfaceMap() = default;

int SurfaceMap::keyframe_count() const { return static_cast<int>(impl_->places.size()); }

const MapKeyframe& SurfaceMap::Impl::place(int keyframe_id) const {
  return *std::lower_bound(places.begin(), places.end(), keyframe_id,
                           [](const MapKeyframe& p, int id) { return p.keyframe->id < id; });
}

std::vector<Pose> SurfaceMap::recognize(const Keyframe& touch) const {
  std::vector<Pose> poses;
  for (const PoseGraphEdge& loop : impl_->recognition.recognize(touch))
    poses.emplace_back(impl_->place(loop.from).map_T_keyframe * loop.from_T_to);
  return poses;
}

std::vector<Pose> SurfaceMap::similar_places(const MapFit& fit) const {
  const MapKeyframe& place = impl_->place(fit.keyframe);
  const Pose keyframe_T_sensor = place.map_T_keyframe.inverse() * fit.map_T_sensor.pose;
  std::vector<Pose> poses = recognize(*place.keyframe);
  for (Pose& pose : poses) pose = normalized(pose * keyframe_T_sensor);
  return poses;
}

/// Returns the keyframe that shows most of the touch, among the kMaxCompared ones whose contact centers are
/// nearest.
Overlap SurfaceMap::Impl::most_overlapping(const Surface& touch, const Pose& map_T_sensor) const {
  const std::vector<Eigen::Vector3d> points = coarse_contact_points_mm(touch);
  const ContactExtent here = extent_of(points);
  std::vector<std::pair<double, const MapKeyframe*>> near;
  for (const MapKeyframe& place : places) {
    const Pose keyframe_T_sensor = place.map_T_keyframe.inverse() * map_T_sensor;
    if (may_overlap(place.extent, here, keyframe_T_sensor))
      near.emplace_back((keyframe_T_sensor * here.center_mm - place.extent.center_mm).norm(), &place);
  }
  std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  near.resize(std::min(near.size(), index(kMaxCompared)));
  Overlap best;
  for (const auto& [distance_mm, place] : near) {
    const Pose keyframe_T_sensor = place->map_T_keyframe.inverse() * map_T_sensor;
    const SurfacePtr surface = place->keyframe->surface.get();
    const double share = shown_share(points, *surface, keyframe_T_sensor);
    if (share > best.share) best = {place, share};
  }
  return best;
}

MapFit SurfaceMap::fit(const NormalFlowReference& touch, const UncertainPose& map_T_sensor,
                       PlacePrior prior) const {
  MapFit fit;
  fit.map_T_sensor = map_T_sensor;
  const auto [place, share] = impl_->most_overlapping(touch.surface(), map_T_sensor.pose);
  fit.covered = place && share >= impl_->options.verification.curvature.min_scr;
  if (!fit.covered) return fit;
  fit.keyframe = place->keyframe->id;
  const UncertainPose sensor_T_keyframe = compose(map_T_sensor.inverse(), {place->map_T_keyframe});
  fit.registration = verify(*place->keyframe->reference.get(), touch, sensor_T_keyframe, prior,
                            impl_->options.registration, impl_->options.verification);
  if (!fit.registration.ok()) return fit;
  const PoseGraphEdge edge = odometry_edge(place->keyframe->id, -1, fit.registration);
  fit.map_T_sensor = {normalized(place->map_T_keyframe * edge.from_T_to),
                      uncertain_motion(edge).from_T_to.covariance};
  return fit;
}

double pose_distance_mm(const Pose& map_T_a, const Pose& map_T_b, const Eigen::Vector3d& center_mm) {
  return std::max((map_T_a * center_mm - map_T_b * center_mm).norm(),
                  kMmPerRad * rotation_angle_rad(map_T_a.inverse() * map_T_b));
}

}  // namespace gelslam
