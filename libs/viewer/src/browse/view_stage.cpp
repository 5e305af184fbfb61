#include "gelslam/viewer/view_stage.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "gelslam/evaluation/triangle_scene.hpp"
#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/viewer/render_target.hpp"
#include "gl/render_annotation.hpp"
#include "scene/view_direction.hpp"

namespace gelslam {
namespace {

constexpr double kFusionBudget_ms = 8;
constexpr std::size_t kOutlinePoints = 5000;

/// Distances by Embree, kept alive by the query itself.
DistanceQuery distance_to(const Mesh& mesh) {
  const auto surface = std::make_shared<const TriangleScene>(mesh);
  return [surface](std::span<const Eigen::Vector3f> points_mm) {
    std::vector<Eigen::Vector3d> points;
    points.reserve(points_mm.size());
    for (const Eigen::Vector3f& p : points_mm) points.push_back(p.cast<double>());
    std::vector<float> distances;
    distances.reserve(points.size());
    for (const ClosestPoint& closest : surface->closest(points)) {
      distances.push_back(static_cast<float>(closest.distance_mm));
    }
    return distances;
  };
}

void add_outline(const Mesh& mesh, std::vector<Eigen::Vector3f>& points) {
  const std::size_t step = 1 + mesh.vertices_mm.size() / kOutlinePoints;
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); i += step) {
    if (mesh.vertices_mm[i].allFinite()) points.push_back(mesh.vertices_mm[i]);
  }
}

}  // namespace

struct ViewStage::Impl {
  ViewContent first;
  std::optional<ViewContent> second;
  Scene first_scene;
  std::unique_ptr<Scene> second_scene;
  std::array<float, 2> distance_range{0, 1};  ///< of the saved surface, kept through time
  std::optional<IncrementalFusion> fusion;    ///< while an earlier time is shown

  Impl(ViewContent first_content, std::optional<ViewContent> second_content)
      : first(std::move(first_content)), second(std::move(second_content)) {}

  SceneStyle first_style(SceneStyle style) const {
    if (style.color == SceneColor::distance && second && !style.range) style.range = distance_range;
    return style;
  }

  SceneStyle second_style(SceneStyle style) const {
    if (const auto legend = first_scene.legend(style)) style.range = {legend->min, legend->max};
    if (style.color == SceneColor::distance || style.color == SceneColor::keyframe)
      style.color = SceneColor::plain;
    return style;
  }

  void show_time(std::optional<double> time_s);

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
    first_scene.set_touch(TouchPatch{patch.surface, patch.map_T_keyframe, history.gradient_scale});
  }
};

/// What is shown changes only where the time does.
void ViewStage::Impl::show_time(std::optional<double> time_s) {
  const RunHistory& history = *first.history;
  show_map(time_s.value_or(history.end_s()));
  if (!time_s) {
    if (fusion) first_scene.set_mesh(first.mesh);
    fusion.reset();
    return;
  }
  if (!fusion) {
    first_scene.clear_mesh();
    IncrementalOptions options;
    options.budget_ms = kFusionBudget_ms;
    fusion.emplace(FusionOptions(), options);
  }
  fusion->set_patches(history.patches_at(*time_s), history.gradient_scale);
}

ViewStage::ViewStage(ViewContent first, std::optional<ViewContent> second)
    : impl_(std::make_unique<Impl>(std::move(first), std::move(second))) {
  impl_->first_scene.set_mesh(impl_->first.mesh);
  if (impl_->first.history) impl_->show_map(impl_->first.history->end_s());
  if (!impl_->second) return;
  impl_->second_scene = std::make_unique<Scene>();
  impl_->second_scene->set_mesh(impl_->second->mesh);
  impl_->first_scene.set_distance_query(distance_to(impl_->second->mesh));
  SceneStyle by_distance;
  by_distance.color = SceneColor::distance;
  const auto legend = impl_->first_scene.legend(by_distance);
  impl_->distance_range = {legend->min, legend->max};
}

ViewStage::~ViewStage() = default;

const RunHistory* ViewStage::history() const {
  return impl_->first.history ? &*impl_->first.history : nullptr;
}

bool ViewStage::has_second() const { return impl_->second_scene != nullptr; }

OrbitCamera ViewStage::first_view(const Viewport& whole) const {
  OrbitCamera camera;
  viewer::detail::look_at_broad_side(impl_->first.mesh, camera);
  camera.fit(outline_mm(), parts(whole).front());
  return camera;
}

std::vector<Eigen::Vector3f> ViewStage::outline_mm() const {
  std::vector<Eigen::Vector3f> points;
  add_outline(impl_->first.mesh, points);
  if (impl_->second) add_outline(impl_->second->mesh, points);
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

std::optional<Eigen::Vector3f> ViewStage::pick(const OrbitCamera& camera, const Eigen::Vector2f& cursor_px,
                                               const Viewport& whole) const {
  const std::vector<Viewport> shown = parts(whole);
  const bool in_second = shown.size() > 1 && cursor_px.x() >= static_cast<float>(shown[1].x - whole.x);
  const Viewport& part = shown[in_second ? 1 : 0];
  const Eigen::Vector2f in_part = cursor_px - Eigen::Vector2f(static_cast<float>(part.x - whole.x), 0);
  return (in_second ? *impl_->second_scene : impl_->first_scene).pick(camera.pick_ray(in_part, part));
}

void ViewStage::draw(const OrbitCamera& camera, const Viewport& whole, const SceneStyle& style) {
  const std::vector<Viewport> shown = parts(whole);
  impl_->first_scene.draw(camera, shown[0], impl_->first_style(style));
  if (impl_->second_scene) impl_->second_scene->draw(camera, shown[1], impl_->second_style(style));
}

bool ViewStage::is_complete() const {
  return impl_->first_scene.statistics().complete &&
         (!impl_->second_scene || impl_->second_scene->statistics().complete);
}

std::optional<ColorLegend> ViewStage::legend(const SceneStyle& style) const {
  return impl_->first_scene.legend(impl_->first_style(style));
}

void ViewStage::set_time(std::optional<double> time_s) {
  if (impl_->first.history) impl_->show_time(time_s);
}

bool ViewStage::work() {
  if (!impl_->fusion) return false;
  const bool more = impl_->fusion->work();
  impl_->first_scene.update(impl_->fusion->take_changed_blocks());
  return more;
}

cv::Mat3b ViewStage::picture(const OrbitCamera& camera, const SceneStyle& style, int width_px,
                             int height_px) {
  using namespace viewer::detail;
  while (work()) {
  }
  const Viewport whole{0, 0, width_px, height_px};
  RenderTarget target(width_px, height_px);
  target.bind();
  impl_->first_scene.finish_details();
  if (impl_->second_scene) impl_->second_scene->finish_details();
  SceneStyle full = style;  // a picture has time
  full.level_of_detail = false;
  draw(camera, whole, full);
  cv::Mat3b result = target.read();
  const std::vector<Viewport> shown = parts(whole);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const cv::Rect area(shown[i].x, 0, shown[i].width, shown[i].height);
    draw_title(result, area, title(i), style.light_theme);
    if (i > 0) continue;
    if (const auto colors = legend(style)) draw_legend(result, area, *colors, style.light_theme);
    draw_scale_bar(result, area, camera.mm_per_px(camera.distance_mm(), shown[i]), style.light_theme);
  }
  return result;
}

}  // namespace gelslam
