#include "guided_scan.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <utility>

#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/slam/guidance.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "virtual_hand.hpp"

namespace gelslam::lab {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kThinkFrames = 12;  // about half a second from one look at the arrow to the next
constexpr double kCoveredMm = 0.15;
constexpr double kPitchPerTurnMm = 4;  // of the helix: less than a contact is wide
constexpr double kLineMm = 8;          // from line to line on a flat object: half a contact

SlamOptions one_threaded() {
  SlamOptions options;
  options.fusion.threads = 1;
  return options;
}

/// The chain of a live scan, in steps: tracking, loops, the map, its growing mesh and what guide() says.
class LiveMap {
 public:
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface) {
    TrackedFrame tracked = tracker_.track(frame, time_s, surface);
    for (const NewKeyframe& added : tracked.new_keyframes) mapper_.add_keyframe(added);
    if (tracked.keyframe && (tracked.keyframe->id != keyframe_ || !tracked.new_keyframes.empty())) {
      keyframe_ = tracked.keyframe->id;
      tracker_.set_neighborhood(mapper_.neighborhood(keyframe_));
      changed_ = true;
    }
    records_.push_back(record_of(tracked));
    last_ = tracked;
    const Vector2d middle = contact_center_mm(*surface);
    touch_ = Vector3d(middle.x(), middle.y(), 0);
    return tracked;
  }

  /// What the live window does twenty times in a second, and the coach once.
  void think() {
    if (changed_) {
      mapper_.has_new_loops() ? mapper_.optimize() : mapper_.update();
      mapper_.assess();
      map_ = mapper_.snapshot();
      grow_mesh();
      changed_ = false;
    }
    if (const std::optional<Pose> pose = map_T_frame(); pose && !blocks_.empty())
      guidance_ = guide(border_, map_, (*pose * touch_).cast<float>(), guidance_);
  }

  /// Nothing while what is touched is not joined to the shown map.
  std::optional<Pose> map_T_frame() const {
    if (last_.status != TrackStatus::tracked || !last_.keyframe) return std::nullopt;
    const MapSnapshot::Node* node = map_.find(last_.keyframe->id);
    if (node == nullptr || node->component != map_.shown_component) return std::nullopt;
    return node->component_T_keyframe * last_.keyframe_T_frame;
  }
  const std::optional<Guidance::Target>& target() const { return guidance_.target; }
  const Vector3d& touch_mm() const { return touch_; }  ///< in the frame
  const MapSnapshot& map() const { return map_; }
  SlamMap finish() const {
    return mapper_.finish(records_, true, [] { return false; });
  }

  Mesh mesh() const {
    Mesh all;
    for (const auto& [key, block] : blocks_) {
      const Eigen::Vector3i first = Eigen::Vector3i::Constant(static_cast<int>(all.vertices_mm.size()));
      all.vertices_mm.insert(all.vertices_mm.end(), block->vertices_mm.begin(), block->vertices_mm.end());
      for (const Eigen::Vector3i& triangle : block->triangles) all.triangles.push_back(triangle + first);
    }
    return all;
  }

 private:
  void grow_mesh() {
    if (!fusion_ || map_.shown_component != component_) {
      fusion_.emplace(options_.fusion, IncrementalOptions{});
      component_ = map_.shown_component;
      blocks_.clear();
    }
    fusion_->set_patches(posed_surfaces(map_), map_.gradient_scale.mean());
    while (fusion_->work()) {
    }
    for (MeshBlock& block : fusion_->take_changed_blocks()) {
      if (block.mesh.triangles.empty())
        blocks_.erase(block.key);
      else
        blocks_[block.key] = std::make_shared<const Mesh>(std::move(block.mesh));
    }
    border_.update(blocks_);
  }

  const SlamOptions options_ = one_threaded();
  Tracker tracker_{options_.tracker, options_.registration, options_.verification};
  Mapper mapper_{options_};
  std::optional<IncrementalFusion> fusion_;
  int component_ = -1, keyframe_ = -1;
  bool changed_ = false;
  std::vector<FrameRecord> records_;
  TrackedFrame last_;
  Vector3d touch_ = Vector3d::Zero();
  MapSnapshot map_;
  MeshBlocks blocks_;
  MeshBorder border_;
  Guidance guidance_;
};

/// Where the hand goes next, in the sensor's x and y.
class Heading {
 public:
  virtual ~Heading() = default;
  virtual void put(VirtualHand& hand) = 0;
  virtual Vector2d next(const VirtualHand& hand, const LiveMap& map, int frame) = 0;
  virtual void blocked() {}  ///< the object ends there
};

Vector2d at_angle(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

/// Anywhere on the object.
class AnyPlace : public Heading {
 public:
  explicit AnyPlace(std::uint64_t seed) : random_(seed) {}
  void put(VirtualHand& hand) override {
    Vector3d direction(normal_(random_), normal_(random_), normal_(random_));
    const Vector2d place = hand.reach_mm().cwiseProduct(Vector2d(uniform_(random_), uniform_(random_)));
    const ShapeKind kind = hand.shape().kind();
    if (kind == ShapeKind::flat) direction = Vector3d::UnitZ();
    if (kind == ShapeKind::rod) direction.x() = 0;
    hand.put(direction.normalized(), kind == ShapeKind::rod ? Vector2d(place.x(), 0) : place);
    angle_rad_ = std::numbers::pi * uniform_(random_);
  }

 protected:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  double angle_rad_ = 0;
};

class RandomHeading final : public AnyPlace {
 public:
  using AnyPlace::AnyPlace;
  Vector2d next(const VirtualHand&, const LiveMap&, int) override {
    constexpr double kRadPerRootS = 1;
    angle_rad_ += kRadPerRootS / std::sqrt(VirtualHand::kRateHz) * normal_(random_);
    return at_angle(angle_rad_);
  }
  void blocked() override { angle_rad_ += std::numbers::pi * (1 + 0.5 * uniform_(random_)); }
};

/// A person looks at the arrow now and then, and goes back where the map is lost.
class GuidedHeading final : public AnyPlace {
 public:
  using AnyPlace::AnyPlace;
  Vector2d next(const VirtualHand&, const LiveMap& map, int frame) override {
    if (frame % kThinkFrames == 0) look(map);
    return at_angle(angle_rad_);
  }

 private:
  void look(const LiveMap& map) {
    const std::optional<Pose> pose = map.map_T_frame();
    const bool was_lost = std::exchange(lost_, !pose && map.map().shown_component >= 0);
    if (lost_ && !was_lost) angle_rad_ += std::numbers::pi;
    if (!pose || !map.target()) return;
    const Vector3d way = pose->inverse() * map.target()->place_mm.cast<double>() - map.touch_mm();
    angle_rad_ = std::atan2(way.y(), way.x());
  }
  bool lost_ = false;
};

/// A helix about the object's x axis from end to end, or lines along it.
class FixedHeading final : public Heading {
 public:
  explicit FixedHeading(std::uint64_t seed) : start_rad_(static_cast<double>(seed)) {}

  void put(VirtualHand& hand) override {
    const Vector2d reach = hand.reach_mm();
    if (hand.shape().kind() == ShapeKind::flat) return hand.put(Vector3d::UnitZ(), -reach);
    const Vector2d around = at_angle(start_rad_);
    const double end = hand.shape().kind() == ShapeKind::body ? kMaxSine : 0;
    hand.put(Vector3d(-end, around.x() * std::sqrt(1 - end * end), around.y() * std::sqrt(1 - end * end)),
             {-reach.x(), 0});
  }

  Vector2d next(const VirtualHand& hand, const LiveMap&, int) override {
    const Vector3d axis = hand.sensor_T_object().linear().col(0);
    const Vector2d along = axis.head<2>().normalized();
    if (hand.shape().kind() == ShapeKind::flat) return line(hand, along);
    const Vector3d middle = hand.sensor_T_object() * hand.shape().bounds_mm().center().cast<double>();
    const bool is_body = hand.shape().kind() == ShapeKind::body;
    const double sine =
        is_body ? -axis.z()
                : (hand.place_mm().x() - hand.shape().bounds_mm().center().x()) / hand.reach_mm().x();
    const double end = is_body ? kMaxSine : 0.99;
    if (sine * onward_ > end) onward_ = -onward_;
    const double turn_mm = 2 * std::numbers::pi * std::abs(middle.z()) * axis.head<2>().norm();
    return (Vector2d(along.y(), -along.x()) +
            onward_ * (is_body ? kPitchPerTurnMm : kLineMm) / turn_mm * along)
        .normalized();
  }

 private:
  static constexpr double kMaxSine = 0.97;  // of the angle from the object's waist toward its end

  Vector2d line(const VirtualHand& hand, const Vector2d& along) {
    const Vector2d reach = hand.reach_mm();
    const Vector3d from_middle = hand.place_mm() - hand.shape().bounds_mm().center().cast<double>();
    const Vector2d across = Vector2d(hand.sensor_T_object().linear().col(1).head<2>());
    if (from_middle.x() * onward_ > 0.99 * reach.x()) {
      onward_ = -onward_;
      to_y_mm_ = from_middle.y() + up_ * kLineMm;
      if (std::abs(from_middle.y()) > 0.99 * reach.y() && from_middle.y() * up_ > 0)
        up_ = -up_, to_y_mm_ = from_middle.y() + up_ * kLineMm;
      to_y_mm_ = std::clamp(*to_y_mm_, -reach.y(), reach.y());
    }
    if (to_y_mm_ && (*to_y_mm_ - from_middle.y()) * up_ > 0.1) return up_ * across;
    to_y_mm_.reset();
    return onward_ * along;
  }

  double start_rad_, onward_ = 1, up_ = 1;
  std::optional<double> to_y_mm_;
};

std::unique_ptr<Heading> make_heading(HandPattern pattern, std::uint64_t seed) {
  if (pattern == HandPattern::guided) return std::make_unique<GuidedHeading>(seed);
  if (pattern == HandPattern::random) return std::make_unique<RandomHeading>(seed);
  return std::make_unique<FixedHeading>(seed);
}

/// The map where its first keyframe really was.
double coverage(const GuidanceObject& object, const LiveMap& map, const std::vector<Pose>& object_T_sensor) {
  const Mesh mesh = map.mesh();
  const MapSnapshot::Node* first = map.map().find(map.map().shown_component);
  if (mesh.triangles.empty() || first == nullptr) return 0;
  const Pose object_T_map =
      object_T_sensor[static_cast<std::size_t>(first->frame)] * first->component_T_keyframe.inverse();
  const TriangleScene scene(transformed(mesh, object_T_map));
  const auto covered =
      std::count_if(object.points_mm.begin(), object.points_mm.end(),
                    [&](const Vector3d& p) { return scene.closest(p).distance_mm < kCoveredMm; });
  return static_cast<double>(covered) / static_cast<double>(object.points_mm.size());
}

/// Of the map as it is saved.
void judge(const SlamMap& map, const GuidanceObject& object, const std::vector<Pose>& object_T_sensor,
           GuidedScanResult& result) {
  result.trials = map.trials, result.components = map.components, result.loops = map.loops;
  const auto truth = [&](std::int64_t frame) { return object_T_sensor[static_cast<std::size_t>(frame)]; };
  const Pose object_T_map = truth(map.anchor_frame);
  double sum = 0;
  int count = 0;
  for (const FrameRecord& frame : map.frames) {
    if (!map.has_pose(frame)) continue;
    const Pose pose = object_T_map * map.anchor_T_keyframe(frame.keyframe) * frame.keyframe_T_frame;
    const double error_mm = (pose.translation() - truth(frame.frame).translation()).norm();
    result.worst_drift_mm = std::max(result.worst_drift_mm, error_mm);
    sum += error_mm * error_mm, ++count;
  }
  result.drift_mm = std::sqrt(sum / std::max(1, count));
  const Mesh mesh = fuse_map(map, one_threaded().fusion);
  if (mesh.triangles.empty()) return;
  result.mesh_mm =
      evaluate_mesh(TriangleScene(transformed(mesh, object_T_map)), TriangleScene(object.truth), {})
          .accuracy.mean_mm;
}

}  // namespace

GuidanceObject make_guidance_object(const ShapeSpec& spec) {
  constexpr float kSpacingMm = 0.12F;  // two pixels; drawing formulas would take ten times as long
  constexpr int kPoints = 3000;
  const ShapePtr exact = make_shape(spec);
  GuidanceObject object{spec.name, nullptr, exact->mesh(kSpacingMm), {}};
  object.shape = make_mesh_shape(object.truth);
  std::vector<Vector3d> points;
  for (const SurfaceSample& sample : sample_surface(object.truth, kPoints, 1))
    points.push_back(sample.point_mm);
  const std::vector<bool> can = reachable(object.shape, {}, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (can[i]) object.points_mm.push_back(points[i]);
  return object;
}

GuidedScanResult scan_with_hand(const GuidanceObject& object, const GradientModel& model,
                                const GuidedScanSpec& spec) {
  const SensorGeometry geometry;
  const Optics optics(geometry, {});
  cv::Mat3b background;
  optics.background().convertTo(background, CV_8U);
  SurfaceEstimator estimator(model, background, {});
  const std::unique_ptr<Heading> heading = make_heading(spec.pattern, spec.seed);
  VirtualHand hand(object.shape, geometry, spec.speed_mm_s, spec.seed);
  heading->put(hand);
  LiveMap map;
  GuidedScanResult result;
  std::vector<Pose> object_T_sensor;
  for (int frame = 0; frame < spec.frames; ++frame) {
    if (!hand.move(heading->next(hand, map, frame))) heading->blocked();
    object_T_sensor.push_back(hand.sensor_T_object().inverse());
    const double time_s = frame / VirtualHand::kRateHz;
    const TrackedFrame tracked =
        map.process(frame, time_s, estimator.estimate(optics.render(hand.press(), frame, time_s, true)));
    result.lost += tracked.status != TrackStatus::tracked;
    if ((frame + 1) % kThinkFrames == 0) map.think();
    if ((frame + 1) % kCoverageFrames == 0) result.coverage.push_back(coverage(object, map, object_T_sensor));
  }
  judge(map.finish(), object, object_T_sensor, result);
  return result;
}

std::optional<int> frames_to(const GuidedScanResult& result, double share) {
  const auto first = std::find_if(result.coverage.begin(), result.coverage.end(),
                                  [&](double covered) { return covered >= share; });
  if (first == result.coverage.end()) return std::nullopt;
  return kCoverageFrames * (1 + static_cast<int>(first - result.coverage.begin()));
}

}  // namespace gelslam::lab
