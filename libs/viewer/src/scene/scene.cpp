#include "scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gelslam/image/color_map.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Matrix4f;
using Eigen::Vector3f;

/// The touch is drawn this much closer to the camera, so that errors of the map do not hide it.
constexpr float kTouchLiftMm = 0.25F;
constexpr float kUnjoinedOpacity = 0.8F, kHiddenLineOpacity = 0.16F, kHiddenGhostOpacity = 0.3F;
constexpr float kMinCurvature = 0.05F;  ///< In 1/mm. Smoother surfaces are not exaggerated to look rough.

/// Confidence at which the mesh is cut; at its last triangle it is nearly 0.
constexpr float kSmoothBorder = 0.2F;
constexpr float kFirmWeight = 2.5F;  ///< From this sum of weights on, a surface counts as well observed.
/// Two standard deviations at which the tint begins and is full.
constexpr double kCertainMm = 0.1, kUncertainMm = 1;
const Vector3f kTouchGlow(1.0F, 0.36F, 0.05F), kUnjoinedGlow(0.06F, 0.50F, 0.95F);

std::vector<std::array<std::uint8_t, 3>> colors_of(SceneColor color) {
  return color_map_rgb(color == SceneColor::distance ? ColorMap::distance
                       : color == SceneColor::height ? ColorMap::height
                                                     : ColorMap::confidence);
}

}  // namespace

Eigen::AlignedBox3f Scene::drawn_box() const {
  Eigen::AlignedBox3f box = mesh_.box_mm();
  box.extend(trajectory_box_mm_);
  if (map_T_unjoined_ && !unjoined_box_mm_.isEmpty())
    box.extend(unjoined_box_mm_.transformed(map_T_unjoined_->cast<float>()));
  for (const TouchPatch::Place& place : touch_.places) {
    const double reach = 0.5 * touch_.surface->pixel_pitch_mm *
                         std::hypot(touch_.surface->contact.cols, touch_.surface->contact.rows);
    const Vector3f center = place.map_T_sensor.translation().cast<float>();
    box.extend(Vector3f(center.array() + static_cast<float>(reach)));
    box.extend(Vector3f(center.array() - static_cast<float>(reach)));
  }
  if (box.isEmpty()) return box;
  const Vector3f margin = Vector3f::Constant(2.0F + 0.7F * box.diagonal().norm());  // For lines and axes.
  return {box.min() - margin, box.max() + margin};
}

std::array<float, 2> Scene::range(const SceneStyle& style) const {
  if (style.range) return *style.range;
  if (style.color == SceneColor::confidence) return {0, std::max(mesh_.confidence_p95(), 1e-3F)};
  if (style.color == SceneColor::distance) return {0, distance_limit_mm_};
  const Eigen::AlignedBox3f box = mesh_.box_mm();
  if (style.color != SceneColor::height || box.isEmpty()) return {0, 1};
  return {-box.max().z(), -box.min().z()};
}

void Scene::draw_background() {
  glDisable(GL_DEPTH_TEST);
  background_program_.use();
  glBindVertexArray(no_vertices_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
}

void Scene::draw_mesh(const Matrix4f& clip_T_map, const Matrix4f& camera_T_map, const SceneStyle& style) {
  const bool has_map = style.color != SceneColor::plain && style.color != SceneColor::certainty;
  if (has_map && color_map_for_ != style.color) {
    std::vector<std::uint8_t> rgba;
    for (const auto& [r, g, b] : colors_of(style.color)) rgba.insert(rgba.end(), {r, g, b, 255});
    fill_texture(color_map_.name(), 256, 1, rgba.data());
    color_map_for_ = style.color;
  }
  const auto [low, high] = range(style);
  mesh_program_.use();
  mesh_program_.set("clip_T_map", clip_T_map);
  mesh_program_.set("camera_T_map", camera_T_map);
  mesh_program_.set("color_by", static_cast<int>(style.color));
  mesh_program_.set("shading", static_cast<int>(style.shading));
  mesh_program_.set("range_min", low);
  mesh_program_.set("range_max", high);
  mesh_program_.set("clay", style.plain_rgb);
  mesh_program_.set("curvature_gain", 1.0F / std::max(mesh_.typical_curvature(), kMinCurvature));
  mesh_program_.set("firm_weight", kFirmWeight);
  mesh_program_.set("min_weight", style.smooth_border ? kSmoothBorder : -1.0F);
  mesh_program_.set("color_map", 0);
  mesh_program_.set("certainty", 1);
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, certainty_.name());
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, color_map_.name());
  mesh_.draw();
  for (const GLenum unit : {GL_TEXTURE1, GL_TEXTURE0}) {
    glActiveTexture(unit);
    glBindTexture(GL_TEXTURE_2D, 0);
  }
}

void Scene::draw_unjoined(const Matrix4f& clip_T_camera, const Matrix4f& camera_T_map) {
  if (!map_T_unjoined_) return;
  touch_program_.use();
  touch_program_.set("clip_T_camera", clip_T_camera);
  touch_program_.set("camera_T_sensor", Matrix4f(camera_T_map * map_T_unjoined_->matrix().cast<float>()));
  touch_program_.set("lift_mm", 0.5F * kTouchLiftMm);  // The touch is drawn above it.
  touch_program_.set("through", 0);
  touch_program_.set("glow_rgb", kUnjoinedGlow);
  touch_program_.set("opacity", kUnjoinedOpacity);
  unjoined_.draw();
}

void Scene::draw_touch(const Matrix4f& clip_T_camera, const Matrix4f& camera_T_map) {
  touch_program_.use();
  touch_program_.set("clip_T_camera", clip_T_camera);
  touch_program_.set("lift_mm", kTouchLiftMm);
  touch_program_.set("glow_rgb", kTouchGlow);
  // Transparent touches are drawn faintly through the object, like lines.
  for (const bool through : {true, false}) {
    glDepthFunc(through ? GL_GREATER : GL_LEQUAL);
    glDepthMask(through ? GL_FALSE : GL_TRUE);
    touch_program_.set("through", through ? 1 : 0);
    for (const auto& [map_T_sensor, opacity] : touch_.places) {
      if (through && opacity >= 1) continue;
      touch_program_.set("camera_T_sensor", Matrix4f(camera_T_map * map_T_sensor.matrix().cast<float>()));
      touch_program_.set("opacity", static_cast<float>(opacity) * (through ? kHiddenGhostOpacity : 1));
      touch_mesh_.draw();
    }
  }
}

/// Draws lines fully where they are visible, and faintly through the object.
void Scene::draw_lines(const SceneLines& lines) {
  glDepthFunc(GL_GREATER);
  line_program_.set("opacity", kHiddenLineOpacity);
  lines.draw();
  glDepthFunc(GL_LEQUAL);
  line_program_.set("opacity", 1.0F);
  lines.draw();
}

void Scene::draw_all_lines(const Matrix4f& clip_T_map, const Viewport& viewport, const SceneStyle& style) {
  line_program_.use();
  line_program_.set("clip_T_map", clip_T_map);
  line_program_.set("viewport_px",
                    Eigen::Vector2f(static_cast<float>(viewport.width), static_cast<float>(viewport.height)));
  line_program_.set("scale", std::max(1.0F, static_cast<float>(viewport.height) / 1000.0F));
  if (style.edges) draw_lines(edges_);
  if (style.trajectory) draw_lines(trajectory_);
  if (style.keyframes) draw_lines(keyframes_);
  if (style.sensor) draw_lines(outline_);
}

void Scene::update(const MeshFeed::Changes& changes) {
  if (changes.cleared) mesh_.clear();
  for (const MeshFeed::BlockPtr& block : changes.blocks)
    mesh_.put(block->key, block->mesh, {block->keyframe.begin(), block->keyframe.end()});
}

void Scene::set_mesh(const Mesh& mesh, const std::vector<float>& distance_mm) {
  mesh_.clear();
  mesh_.put(0, mesh, distance_mm);
  distance_limit_mm_ = round_limit_mm(distance_mm);
}

void Scene::set_touch(TouchPatch touch) {
  const TouchMesh mesh = touch.surface ? make_touch_mesh(*touch.surface, touch.gradient_scale) : TouchMesh();
  touch_mesh_.set(mesh.vertices, mesh.triangles);
  outline_.set(sensor_outlines(touch));
  touch_ = std::move(touch);
}

void Scene::set_unjoined(const TouchMesh& mesh) {
  unjoined_.set(mesh.vertices, mesh.triangles);
  unjoined_box_mm_.setEmpty();
  for (const TouchMesh::Vertex& vertex : mesh.vertices) unjoined_box_mm_.extend(vertex.position_mm);
}

void Scene::set_trajectory(const std::vector<std::vector<Pose>>& map_T_sensor) {
  const std::vector<SceneLine> lines = trajectory_lines(map_T_sensor);
  trajectory_.set(lines);
  trajectory_box_mm_.setEmpty();
  for (const SceneLine& line : lines) trajectory_box_mm_.extend(line.from_mm).extend(line.to_mm);
}

void Scene::set_map(const MapSnapshot& map) {
  keyframes_.set(keyframe_lines(map));
  edges_.set(edge_lines(map));
  const cv::Mat4b uncertainty = uncertainty_by_keyframe(map, kCertainMm, kUncertainMm);
  fill_texture(certainty_.name(), uncertainty.cols, uncertainty.rows, uncertainty.ptr());
}

void Scene::draw(const OrbitCamera& camera, const Viewport& viewport, const SceneStyle& style) {
  const Matrix4f clip_T_camera = camera.projection(viewport.aspect(), drawn_box());
  const Matrix4f camera_T_map = camera.camera_T_map(), clip_T_map = clip_T_camera * camera_T_map;
  glViewport(viewport.x, viewport.y, viewport.width, viewport.height);
  glScissor(viewport.x, viewport.y, viewport.width, viewport.height);
  glEnable(GL_SCISSOR_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LEQUAL);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClear(GL_DEPTH_BUFFER_BIT);
  draw_background();
  draw_mesh(clip_T_map, camera_T_map, style);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  draw_unjoined(clip_T_camera, camera_T_map);
  if (style.touch) draw_touch(clip_T_camera, camera_T_map);
  glDepthMask(GL_FALSE);
  draw_all_lines(clip_T_map, viewport, style);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_SCISSOR_TEST);
  glBindVertexArray(0);
  glUseProgram(0);
}

std::optional<ColorLegend> Scene::legend(const SceneStyle& style) const {
  static constexpr const char* kTitles[] = {"", "confidence", "height", "distance"};
  if (style.color == SceneColor::plain || style.color == SceneColor::certainty) return std::nullopt;
  const auto [low, high] = range(style);
  const char* unit = style.color == SceneColor::confidence ? "keyframes" : "mm";
  return ColorLegend{kTitles[static_cast<int>(style.color)], unit, low, high, colors_of(style.color), {}};
}

}  // namespace gelslam::viewer::detail
