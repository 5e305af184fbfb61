// Makes a map from a mesh by simulation (not in the papers). Points are sampled on the surface in random
// order. At each one that no touch covers yet, the simulated sensor is pressed on along the mean normal; the
// gel's slopes are rendered without color and integrated to a surface as for a real image. A touch covers the
// points in the inner part of its contact whose normals face it. Touches in a batch are far enough apart not
// to cover each other, so that they can be simulated in parallel with the same result.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/core/point_grid.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/contact_overlap.hpp"
#include "gelslam/surface/slopes.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

// Distance between sampled points where the sensor may be pressed on.
constexpr double kSampleSpacingMm = 0.8;
constexpr int kMaxSamples = 100'000;
// Normals are averaged over this radius (half a contact), as the pressed gel averages over it.
constexpr double kNormalRadiusMm = 2.5;
// A point is covered when it lies within kInnerShare of the contact's radius, and its normal is within
// kFacingRad of the sensor's axis.
constexpr double kInnerShare = 0.4;
constexpr double kFacingRad = 0.35;
constexpr std::size_t kBatch = 16;  // Touches that are simulated in parallel.
constexpr int kMinContactPx = 500;

/// A point of the surface, with the mean normal around it.
struct SurfacePlace {
  Eigen::Vector3d point_mm, normal;
  bool done = false;  // Covered by a touch, or tried without contact.
};

/// The part of the surface that a touch covers.
struct Covered {
  Eigen::Vector3d center_mm, normal;
  double radius_mm;
};

PointGrid grid_of(const std::vector<SurfacePlace>& places) {
  std::vector<Eigen::Vector3d> points_mm;
  points_mm.reserve(places.size());
  for (const SurfacePlace& place : places) points_mm.push_back(place.point_mm);
  return {std::move(points_mm), kNormalRadiusMm};
}

Mesh facing_outward(Mesh mesh) {
  if (volume_mm3(mesh) >= 0) return mesh;
  for (Eigen::Vector3i& t : mesh.triangles) std::swap(t[1], t[2]);
  mesh.normals.clear();
  return mesh;
}

/// Returns points sampled on the surface, in random order so that touches spread evenly.
std::vector<SurfacePlace> places_on(const TriangleScene& scene) {
  const double wanted = area_mm2(scene.mesh()) / (kSampleSpacingMm * kSampleSpacingMm);
  const int count = static_cast<int>(std::clamp(wanted, 100.0, static_cast<double>(kMaxSamples)));
  std::vector<SurfacePlace> places;
  for (const SurfaceSample& sample : sample_surface(scene.mesh(), count, 1))
    places.push_back({sample.point_mm, scene.triangle_normal(sample.triangle)});
  std::mt19937_64 random;  // The default seed makes the result repeatable.
  for (std::size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[random() % i]);
  const PointGrid grid = grid_of(places);
  std::vector<Eigen::Vector3d> means(places.size());
  parallel_for_ranges(places.size(), 256, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      grid.visit(places[i].point_mm, kNormalRadiusMm, [&](std::size_t k) {
        // Points on the other side of a thin object do not count.
        if (places[k].normal.dot(places[i].normal) > -0.3) sum += places[k].normal;
      });
      means[i] = sum;
    }
  });
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].normal = means[i].normalized();
    places[i].done = !(means[i].norm() > 1e-6);
  }
  return places;
}

/// Returns the pose of the sensor at a point of the surface, with its z axis along the inward normal.
Pose object_T_sensor_at(const SurfacePlace& place) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_of_z_to(-place.normal);
  pose.translation() = place.point_mm;
  return pose;
}

/// Returns a camera without lens distortion, whose images are the rectified grid.
Optics without_lens(const CameraModel& camera) {
  const SensorOptics optics{.camera_distance_mm = camera.optics.camera_distance_mm,
                            .gel_dome_per_mm = camera.optics.gel_dome_per_mm};
  return {{camera.size.width, camera.size.height, camera.pitch_mm, optics}, {}};
}

/// That camera, and the gel at rest as it sees it.
struct SeenGel {
  explicit SeenGel(const CameraModel& camera)
      : optics(without_lens(camera)), rest(optics.view(gel_at_rest(optics.gel_grid()))) {}
  Optics optics;
  GelView rest;
};

/// Returns the surface that the sensor measures when it is pressed on at a point, or nothing if there is too
/// little contact.
std::optional<PosedSurface> touch_at(const SurfacePlace& place, const Shape& shape, const SeenGel& seen,
                                     const MeshMapOptions& options) {
  const SensorGeometry& geometry = seen.optics.gel_grid();
  const std::optional<Pose> sensor_T_object =
      settle_object(shape, object_T_sensor_at(place).inverse(), options.indentation_mm, geometry);
  if (!sensor_T_object) return std::nullopt;
  const GelShape gel = press_object(shape, *sensor_T_object, geometry);
  const GelView view = seen.optics.view(gel);
  std::array<cv::Mat1f, 2> slope;
  cv::split(view.slope - seen.rest.slope, slope.data());
  cv::Mat1b touched;
  cv::remap(gel.contact, touched, view.place_px, cv::noArray(), cv::INTER_NEAREST);
  // GradientSurfaces erodes the contact that it is given. Dilation before erosion closes small pits that the
  // gel bridges.
  cv::dilate(touched, touched, GradientSurfaces::border(options.camera.pitch_mm));
  PosedSurface patch;
  patch.surface = GradientSurfaces(options.camera).make(slope[0], slope[1], touched);
  patch.map_T_keyframe = sensor_T_object->inverse();
  if (patch.surface->contact_pixels < kMinContactPx) return std::nullopt;
  return patch;
}

Covered covered_by(const PosedSurface& patch) {
  const Eigen::Vector3d center = extent_of(coarse_contact_points_mm(*patch.surface.get())).center_mm;
  const double area = patch.surface->contact_mm2();
  return {patch.map_T_keyframe * center, -patch.map_T_keyframe.linear().col(2),
          kInnerShare * std::sqrt(area / std::numbers::pi)};
}

/// Returns a warning if many triangles are oriented inconsistently, or an empty string. Two triangles with
/// the same orientation traverse their common edge in opposite directions.
std::string orientation_warning(const Mesh& mesh) {
  constexpr double kMaxTurnedShare = 0.1;  // A good mesh may have a few such edges.
  std::vector<std::pair<int, int>> edges;
  std::set<std::set<int>> seen;  // Files may contain triangles twice.
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3 && (k > 0 || seen.insert({t[0], t[1], t[2]}).second); ++k)
      edges.emplace_back(t[k], t[(k + 1) % 3]);
  std::ranges::sort(edges);
  double turned = 0;
  for (std::size_t k = 1; k < edges.size(); ++k) turned += edges[k] == edges[k - 1];
  const double share = 2 * turned / static_cast<double>(edges.size());
  if (share < kMaxTurnedShare) return "";
  return fmt::format(
      "at {:.0f} % of the mesh's edges one triangle faces inward and one outward; turn them to one "
      "side in another program (MeshLab: re-orient all faces coherently)",
      100 * share);
}

/// Simulates touches in batches until all points are covered.
class MeshToucher {
 public:
  MeshToucher(const Mesh& mesh, const MeshMapOptions& options)
      : options_(options),
        orientation_warning_(orientation_warning(mesh)),
        gel_(options.camera),
        scene_(mesh),
        shape_(make_mesh_shape(mesh)),
        places_(places_on(scene_)),
        grid_(grid_of(places_)) {}

  MeshMap run(ProgressSink& progress) {
    progress.begin("touching the mesh", static_cast<std::int64_t>(places_.size()));
    while (true) {
      const std::vector<std::size_t> batch = next_batch();
      if (batch.empty()) break;
      std::vector<std::optional<PosedSurface>> touched(batch.size());
      parallel_for(batch.size(), 0,
                   [&](std::size_t k) { touched[k] = touch_at(places_[batch[k]], *shape_, gel_, options_); });
      for (std::size_t k = 0; k < batch.size(); ++k) {
        if (touched[k]) keep(std::move(*touched[k]));
        places_[batch[k]].done = true;
      }
      progress.update(std::count_if(places_.begin(), places_.end(), [](const auto& p) { return p.done; }));
    }
    progress.end();
    if (map_.patches.empty())
      throw Error(orientation_warning_.empty() ? "the gel touches the mesh nowhere; check its unit"
                                               : orientation_warning_);
    map_.covered_share = static_cast<double>(covered_) / static_cast<double>(places_.size());
    if (static_cast<int>(map_.patches.size()) >= options_.max_touches)
      map_.warning = fmt::format(
          "the surface is larger than {} touches cover; allow more touches, or give a mesh of the part that "
          "is touched",
          options_.max_touches);
    append_sentence(map_.warning, orientation_warning_);
    return std::move(map_);
  }

 private:
  /// Returns points that are not covered, with enough distance between them that none would cover another.
  std::vector<std::size_t> next_batch() {
    std::vector<std::size_t> batch;
    const std::size_t left =
        index(options_.max_touches) - std::min(map_.patches.size(), index(options_.max_touches));
    for (; first_ < places_.size() && places_[first_].done; ++first_) {
    }
    for (std::size_t i = first_; i < places_.size() && batch.size() < std::min(kBatch, left); ++i) {
      if (places_[i].done) continue;
      const bool is_apart = std::all_of(batch.begin(), batch.end(), [&](std::size_t other) {
        return (places_[i].point_mm - places_[other].point_mm).norm() > 2 * kNormalRadiusMm;
      });
      if (is_apart) batch.push_back(i);
    }
    return batch;
  }

  void keep(PosedSurface patch) {
    const Covered covered = covered_by(patch);
    grid_.visit(covered.center_mm, covered.radius_mm, [&](std::size_t i) {
      if (places_[i].normal.dot(covered.normal) < std::cos(kFacingRad)) return;
      if (!std::exchange(places_[i].done, true)) ++covered_;
    });
    patch.id = static_cast<int>(map_.patches.size());
    map_.patches.push_back(std::move(patch));
  }

  const MeshMapOptions options_;
  const std::string orientation_warning_;
  const SeenGel gel_;
  TriangleScene scene_;
  ShapePtr shape_;
  std::vector<SurfacePlace> places_;
  PointGrid grid_;
  std::size_t first_ = 0;  // All points before this one are done.
  std::int64_t covered_ = 0;
  MeshMap map_;
};

}  // namespace

CameraModel configured_camera(const Config& config) {
  return {
      {config.sensor.width_px, config.sensor.height_px}, config.sensor.pixel_pitch_mm, config.surface.optics};
}

MeshMap make_mesh_map(const Mesh& mesh, const MeshMapOptions& options, ProgressSink& progress) {
  if (!(options.indentation_mm >= 0.05 && options.indentation_mm <= 1.5))
    throw Error("indentation must be between 0.05 and 1.5 mm");
  if (options.max_touches < 1) throw Error("a map takes at least one touch");
  if (const std::string warning = size_warning(mesh); !warning.empty()) throw Error("the mesh " + warning);
  const TriangleScene checked(mesh);  // throws for indices out of range
  return MeshToucher(facing_outward(checked.mesh()), options).run(progress);
}

}  // namespace gelslam
