#include "browse/view_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/slam/status_text.hpp"
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
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); i += step)
    if (mesh.vertices_mm[i].allFinite()) points.push_back(mesh.vertices_mm[i]);
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

ViewStage::ViewStage(ViewContent first, std::optional<ViewContent> second)
    : first_(std::move(first)), second_(std::move(second)) {
  set_time(std::nullopt);
  if (!second_) {
    first_scene_.set_mesh(first_.mesh);
    return;
  }
  second_scene_.emplace().set_mesh(second_->mesh);
  const TriangleScene target(second_->mesh);
  distance_notes_ = distance_notes(first_.mesh, target);
  first_scene_.set_mesh(first_.mesh, distances_mm(first_.mesh, target));
}

SceneStyle ViewStage::second_style(SceneStyle style) const {
  if (const auto legend = first_scene_.legend(style)) style.range = {legend->min, legend->max};
  if (style.color == SceneColor::distance) style.color = SceneColor::plain;
  return style;
}

OrbitCamera ViewStage::first_view(const Viewport& whole) const {
  OrbitCamera camera;
  look_at_broad_side(first_.mesh, camera);
  return camera.fitted(outline_mm(), parts(whole).front());
}

std::vector<Eigen::Vector3f> ViewStage::outline_mm() const {
  std::vector<Eigen::Vector3f> points;
  add_vertices(first_.mesh, kOutlinePoints, points);
  if (second_) add_vertices(second_->mesh, kOutlinePoints, points);
  return points;
}

std::vector<Viewport> ViewStage::parts(const Viewport& whole) const {
  if (!second_scene_) return {whole};
  const int left = whole.width / 2;
  return {{whole.x, whole.y, std::max(left, 1), whole.height},
          {whole.x + left, whole.y, std::max(whole.width - left, 1), whole.height}};
}

std::string ViewStage::title(std::size_t part) const { return part == 0 ? first_.name : second_->name; }

std::string ViewStage::warning() const {
  std::string text;
  for (const std::string& warning : first_.warnings) text += (text.empty() ? "" : " ") + sentences(warning);
  return text;
}

std::optional<Eigen::Vector3f> ViewStage::pick(std::size_t part, const PickRay& ray) const {
  return (part > 0 && second_scene_ ? *second_scene_ : first_scene_).pick(ray);
}

void ViewStage::draw(const OrbitCamera& camera, const Viewport& whole, const SceneStyle& style) {
  const std::vector<Viewport> shown = parts(whole);
  first_scene_.draw(camera, shown[0], style);
  if (second_scene_) second_scene_->draw(camera, shown[1], second_style(style));
}

std::optional<ColorLegend> ViewStage::legend(const SceneStyle& style) const {
  auto legend = first_scene_.legend(style);
  if (legend && style.color == SceneColor::distance) legend->notes = distance_notes_;
  return legend;
}

void ViewStage::set_time(std::optional<double> given_s) {
  if (!first_.history) return;
  const RunHistory& history = *first_.history;
  const double time_s = given_s.value_or(history.end_s());
  first_scene_.set_map(history.map_at(time_s));
  first_scene_.set_trajectory(history.trajectory_at(time_s));
  const auto next = std::ranges::upper_bound(history.keyframes_s, time_s);
  if (next == history.keyframes_s.begin() || time_s >= history.end_s())
    return first_scene_.set_touch(std::nullopt);
  const Session& session = history.session;
  const PosedSurface& patch =
      session.patches[static_cast<std::size_t>(next - history.keyframes_s.begin()) - 1];
  first_scene_.set_touch(TouchPatch{patch.surface.get(), patch.map_T_keyframe, session.gradient_scale});
}

}  // namespace gelslam::viewer::detail
