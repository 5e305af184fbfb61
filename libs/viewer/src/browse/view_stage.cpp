#include "browse/view_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr std::size_t kOutlinePoints = 5000;

/// Of the mesh's vertices.
std::vector<float> distances_mm(const Mesh& mesh, const TriangleScene& target) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(mesh.vertices_mm.size());
  for (const Eigen::Vector3f& p : mesh.vertices_mm) points.push_back(p.cast<double>());
  std::vector<float> distances;
  distances.reserve(points.size());
  for (const ClosestPoint& closest : target.closest(points))
    distances.push_back(static_cast<float>(closest.distance_mm));
  return distances;
}

/// About `count` vertices, evenly from the whole mesh.
void add_vertices(const Mesh& mesh, std::size_t count, std::vector<Eigen::Vector3f>& points) {
  const std::size_t step = 1 + mesh.vertices_mm.size() / count;
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); i += step) {
    if (mesh.vertices_mm[i].allFinite()) points.push_back(mesh.vertices_mm[i]);
  }
}

/// As `evaluate` measures; nothing of a mesh without area.
std::vector<std::string> distance_notes(const Mesh& mesh, const TriangleScene& target) {
  try {
    const DistanceSummary distances = distances_from(mesh, target);
    return {fmt::format("mean {:.3f} mm", distances.mean_mm),
            fmt::format("90 % below {:.3f} mm", distances.p90_mm)};
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

struct ViewStage::Impl {
  ViewContent first;
  std::optional<ViewContent> second;
  Scene first_scene;
  std::unique_ptr<Scene> second_scene;
  std::vector<std::string> distance_notes;

  Impl(ViewContent first_content, std::optional<ViewContent> second_content)
      : first(std::move(first_content)), second(std::move(second_content)) {}

  SceneStyle second_style(SceneStyle style) const {
    if (const auto legend = first_scene.legend(style)) style.range = {legend->min, legend->max};
    if (style.color == SceneColor::distance) style.color = SceneColor::plain;
    return style;
  }

  /// Keyframes, edges, trajectory and touch of a time.
  void show_map(double time_s) {
    const RunHistory& history = *first.history;
    first_scene.set_map(history.map_at(time_s));
    const std::vector<std::vector<Pose>> trajectory = history.trajectory_at(time_s);
    first_scene.set_trajectory(trajectory);
    const auto next =
        std::upper_bound(history.keyframes.begin(), history.keyframes.end(), time_s,
                         [](double t, const RunHistory::KeyframeAt& k) { return t < k.time_s; });
    if (next == history.keyframes.begin() || time_s >= history.end_s()) {
      first_scene.set_touch(std::nullopt);
      return;
    }
    const PosedSurface& patch = std::prev(next)->patch;
    first_scene.set_touch(TouchPatch{patch.surface.get(), patch.map_T_keyframe, history.gradient_scale});
  }
};

ViewStage::ViewStage(ViewContent first, std::optional<ViewContent> second)
    : impl_(std::make_unique<Impl>(std::move(first), std::move(second))) {
  if (impl_->first.history) impl_->show_map(impl_->first.history->end_s());
  if (!impl_->second) {
    impl_->first_scene.set_mesh(impl_->first.mesh);
    return;
  }
  impl_->second_scene = std::make_unique<Scene>();
  impl_->second_scene->set_mesh(impl_->second->mesh);
  const TriangleScene target(impl_->second->mesh);
  impl_->distance_notes = distance_notes(impl_->first.mesh, target);
  impl_->first_scene.set_mesh(impl_->first.mesh, distances_mm(impl_->first.mesh, target));
}

ViewStage::~ViewStage() = default;

const RunHistory* ViewStage::history() const {
  return impl_->first.history ? &*impl_->first.history : nullptr;
}

bool ViewStage::has_second() const { return impl_->second_scene != nullptr; }

OrbitCamera ViewStage::first_view(const Viewport& whole) const {
  OrbitCamera camera;
  look_at_broad_side(impl_->first.mesh, camera);
  return camera.fitted(outline_mm(), parts(whole).front());
}

std::vector<Eigen::Vector3f> ViewStage::outline_mm() const {
  std::vector<Eigen::Vector3f> points;
  add_vertices(impl_->first.mesh, kOutlinePoints, points);
  if (impl_->second) add_vertices(impl_->second->mesh, kOutlinePoints, points);
  return points;
}

std::vector<Viewport> ViewStage::parts(const Viewport& whole) const {
  if (!impl_->second_scene) return {whole};
  const int left = whole.width / 2;
  return {{whole.x, whole.y, std::max(left, 1), whole.height},
          {whole.x + left, whole.y, std::max(whole.width - left, 1), whole.height}};
}

std::string ViewStage::title(std::size_t part) const {
  return part == 0 ? impl_->first.name : impl_->second->name;
}

std::string ViewStage::warning() const {
  return impl_->first.warnings.empty() ? "" : "The run has warnings; gelslam info says them.";
}

std::optional<Eigen::Vector3f> ViewStage::pick(std::size_t part, const PickRay& ray) const {
  return (part > 0 && impl_->second_scene ? *impl_->second_scene : impl_->first_scene).pick(ray);
}

void ViewStage::draw(const OrbitCamera& camera, const Viewport& whole, const SceneStyle& style) {
  const std::vector<Viewport> shown = parts(whole);
  impl_->first_scene.draw(camera, shown[0], style);
  if (impl_->second_scene) impl_->second_scene->draw(camera, shown[1], impl_->second_style(style));
}

std::optional<ColorLegend> ViewStage::legend(const SceneStyle& style) const {
  auto legend = impl_->first_scene.legend(style);
  if (legend && style.color == SceneColor::distance) legend->notes = impl_->distance_notes;
  return legend;
}

void ViewStage::set_time(std::optional<double> time_s) {
  if (impl_->first.history) impl_->show_map(time_s.value_or(impl_->first.history->end_s()));
}

}  // namespace gelslam::viewer::detail
