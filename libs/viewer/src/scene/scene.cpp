#include "gelslam/viewer/scene.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "gelslam/image/color_map.hpp"
#include "scene/scene_geometry.hpp"
#include "scene/scene_lines.hpp"
#include "scene/scene_mesh.hpp"
#include "scene/scene_shaders.hpp"
#include "scene/scene_touch.hpp"

namespace gelslam {
namespace {

using namespace viewer::detail;
using Eigen::Matrix4f;
using Eigen::Vector3f;

constexpr float kTouchLiftMm = 0.25F;  ///< the map below the touch may be so much off before it hides it
constexpr float kPieceOpacity = 0.8F, kHiddenLineOpacity = 0.16F, kHiddenGhostOpacity = 0.3F;
constexpr float kMinCurvature = 0.05F;  ///< 1/mm; smoother surfaces are not made to look rough

constexpr float kSmoothBorder = 0.2F;                 ///< weight; at the last triangle there is nearly none
constexpr float kFirmWeight = 2.5F;                   ///< of so many keyframes a surface is seen well
constexpr double kCertainMm = 0.1, kUncertainMm = 1;  ///< two standard deviations: tint begins, is full
const Vector3f kTouchGlow(1.0F, 0.36F, 0.05F), kPieceGlow(0.06F, 0.50F, 0.95F);

Rgba outline_color(double opacity) {
  return {255, 150, 40, static_cast<std::uint8_t>(255 * std::clamp(opacity, 0.0, 1.0))};
}

std::vector<std::array<std::uint8_t, 3>> colors_of(SceneColor color) {
  return color_map_rgb(color == SceneColor::distance ? ColorMap::distance
                       : color == SceneColor::height ? ColorMap::height
                                                     : ColorMap::confidence);
}

}  // namespace

struct Scene::Impl {
  GlProgram mesh_program{kMeshVertexShader, kMeshFragmentShader};
  GlProgram touch_program{kTouchVertexShader, kTouchFragmentShader};
  GlProgram line_program{kLineVertexShader, kLineFragmentShader};
  GlProgram background_program{kBackgroundVertexShader, kBackgroundFragmentShader};
  GlVertexArray no_vertices;
  GlTexture color_map, certainty;  ///< the last by keyframe id, as doubt_by_keyframe()
  SceneColor color_map_for = SceneColor::plain;
  SceneMesh mesh;
  SceneTouch touch, piece;
  SceneLines outline, trajectory, keyframes, edges;
  std::optional<Pose> map_T_piece;
  Eigen::AlignedBox3f piece_box_mm;  ///< in its own frame
  std::optional<TouchPatch> touch_patch;
  Eigen::AlignedBox3f trajectory_box_mm;
  float distance_limit_mm = 1;

  /// Where the touch is drawn: the place first that its mesh was made for.
  std::vector<TouchPatch::Ghost> touch_places() const {
    if (!touch_patch || !touch_patch->surface || !touch_patch->map_T_sensor.matrix().allFinite()) return {};
    std::vector<TouchPatch::Ghost> places = {{touch_patch->map_T_sensor, touch_patch->opacity}};
    std::copy_if(touch_patch->ghosts.begin(), touch_patch->ghosts.end(), std::back_inserter(places),
                 [](const TouchPatch::Ghost& g) { return g.map_T_sensor.matrix().allFinite(); });
    return places;
  }

  Eigen::AlignedBox3f drawn_box() const {
    Eigen::AlignedBox3f box = mesh.box_mm();
    box.extend(trajectory_box_mm);
    if (map_T_piece && !piece_box_mm.isEmpty())
      box.extend(piece_box_mm.transformed(map_T_piece->cast<float>()));
    for (const TouchPatch::Ghost& place : touch_places()) {
      const double reach = 0.5 * touch_patch->surface->pixel_pitch_mm *
                           std::hypot(touch_patch->surface->contact.cols, touch_patch->surface->contact.rows);
      const Vector3f center = place.map_T_sensor.translation().cast<float>();
      box.extend(Vector3f(center.array() + static_cast<float>(reach)));
      box.extend(Vector3f(center.array() - static_cast<float>(reach)));
    }
    if (!box.isEmpty()) {  // room for lifted lines and axes
      const Vector3f margin = Vector3f::Constant(2.0F + 0.7F * box.diagonal().norm());
      box = Eigen::AlignedBox3f(box.min() - margin, box.max() + margin);
    }
    return box;
  }

  std::array<float, 2> range(const SceneStyle& style) const {
    if (style.range) return *style.range;
    if (style.color == SceneColor::confidence) return {0, std::max(mesh.confidence_p95(), 1e-3F)};
    if (style.color == SceneColor::distance) return {0, distance_limit_mm};
    const Eigen::AlignedBox3f box = mesh.box_mm();
    if (style.color != SceneColor::height || box.isEmpty()) return {0, 1};
    return {-box.max().z(), -box.min().z()};
  }

  void draw_background() {
    glDisable(GL_DEPTH_TEST);
    background_program.use();
    glBindVertexArray(no_vertices.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glEnable(GL_DEPTH_TEST);
  }

  void draw_mesh(const OrbitCamera& camera, const Matrix4f& clip_T_map, const SceneStyle& style) {
    const bool has_map = style.color != SceneColor::plain && style.color != SceneColor::certainty;
    if (has_map && color_map_for != style.color) {
      std::vector<std::uint8_t> rgba;
      for (const auto& [r, g, b] : colors_of(style.color)) rgba.insert(rgba.end(), {r, g, b, 255});
      fill_texture(color_map.name(), 256, 1, rgba.data());
      color_map_for = style.color;
    }
    const auto [low, high] = range(style);
    mesh_program.use();
    mesh_program.set("clip_T_map", clip_T_map);
    mesh_program.set("camera_T_map", camera.camera_T_map());
    mesh_program.set("color_by", static_cast<int>(style.color));
    mesh_program.set("shading", static_cast<int>(style.shading));
    mesh_program.set("range_min", low);
    mesh_program.set("range_max", high);
    mesh_program.set("clay", style.plain_rgb);
    mesh_program.set("curvature_gain", 1.0F / std::max(mesh.typical_curvature(), kMinCurvature));
    mesh_program.set("firm_weight", kFirmWeight);
    mesh_program.set("min_weight", style.smooth_border && mesh.has_confidence() ? kSmoothBorder : -1.0F);
    mesh_program.set("color_map", 0);
    mesh_program.set("certainty", 1);
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, certainty.name());
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, color_map.name());
    mesh.draw(clip_T_map);
    for (const GLenum unit : {GL_TEXTURE1, GL_TEXTURE0}) {
      glActiveTexture(unit);
      glBindTexture(GL_TEXTURE_2D, 0);
    }
  }

  void draw_piece(const OrbitCamera& camera, const Matrix4f& clip_T_camera) {
    if (!map_T_piece) return;
    touch_program.use();
    touch_program.set("clip_T_camera", clip_T_camera);
    touch_program.set("camera_T_map", Matrix4f(camera.camera_T_map() * map_T_piece->matrix().cast<float>()));
    touch_program.set("lift_mm", 0.5F * kTouchLiftMm);  // the touch lies over it
    touch_program.set("through", 0);
    touch_program.set("glow_rgb", kPieceGlow);
    touch_program.set("opacity", kPieceOpacity);
    piece.draw();
  }

  void draw_touch(const OrbitCamera& camera, const Matrix4f& clip_T_camera) {
    touch_program.use();
    touch_program.set("clip_T_camera", clip_T_camera);
    touch_program.set("lift_mm", kTouchLiftMm);
    touch_program.set("glow_rgb", kTouchGlow);
    for (const bool through : {true, false}) {  // ghosts are faint through the object, as lines are
      glDepthFunc(through ? GL_GREATER : GL_LEQUAL);
      glDepthMask(through ? GL_FALSE : GL_TRUE);
      touch_program.set("through", through ? 1 : 0);
      for (const TouchPatch::Ghost& place : touch_places()) {
        if (through && place.opacity >= 1) continue;
        const Pose moved = place.map_T_sensor * touch_patch->map_T_sensor.inverse();
        touch_program.set("camera_T_map", Matrix4f(camera.camera_T_map() * moved.matrix().cast<float>()));
        touch_program.set("opacity", static_cast<float>(place.opacity) * (through ? kHiddenGhostOpacity : 1));
        touch.draw();
      }
    }
  }

  /// Full where it can be seen, faint through the object.
  void draw_lines(const SceneLines& lines) {
    if (lines.empty()) return;
    glDepthFunc(GL_GREATER);
    line_program.set("opacity", kHiddenLineOpacity);
    lines.draw();
    glDepthFunc(GL_LEQUAL);
    line_program.set("opacity", 1.0F);
    lines.draw();
  }

  void draw_all_lines(const Matrix4f& clip_T_map, const Viewport& viewport, const SceneStyle& style) {
    line_program.use();
    line_program.set("clip_T_map", clip_T_map);
    line_program.set("viewport_px", Eigen::Vector2f(static_cast<float>(viewport.width),
                                                    static_cast<float>(viewport.height)));
    line_program.set("scale", std::max(1.0F, static_cast<float>(viewport.height) / 1000.0F));
    if (style.edges) draw_lines(edges);
    if (style.trajectory) draw_lines(trajectory);
    if (style.keyframes) draw_lines(keyframes);
    if (style.sensor) draw_lines(outline);
  }
};

Scene::Scene() : impl_(std::make_unique<Impl>()) {}
Scene::~Scene() = default;

void Scene::update(const MeshFeed::Changes& changes) {
  if (changes.cleared) impl_->mesh.clear();
  for (const MeshFeed::BlockPtr& block : changes.blocks)
    impl_->mesh.put(block->key, make_drawable(block->mesh, {block->keyframe.begin(), block->keyframe.end()}));
}

void Scene::set_mesh(const Mesh& mesh, const std::vector<float>& distance_mm) {
  impl_->mesh.clear();
  impl_->mesh.put(0, make_drawable(mesh, distance_mm));
  impl_->distance_limit_mm = round_limit_mm(distance_mm);
}

void Scene::set_touch(std::optional<TouchPatch> touch) {
  impl_->touch.set(touch ? make_touch_mesh(*touch) : TouchMesh());
  impl_->touch_patch = std::move(touch);
  std::vector<SceneLine> outlines;
  for (const TouchPatch::Ghost& place : impl_->touch_places()) {
    const auto lines =
        sensor_outline({impl_->touch_patch->surface, place.map_T_sensor}, outline_color(place.opacity));
    outlines.insert(outlines.end(), lines.begin(), lines.end());
  }
  impl_->outline.set(outlines);
}

void Scene::set_piece(const TouchMesh& mesh) {
  impl_->piece.set(mesh);
  impl_->piece_box_mm.setEmpty();
  for (const TouchMesh::Vertex& vertex : mesh.vertices) impl_->piece_box_mm.extend(vertex.position_mm);
}

void Scene::place_piece(const std::optional<Pose>& map_T_piece) { impl_->map_T_piece = map_T_piece; }

void Scene::set_trajectory(const std::vector<std::vector<Pose>>& map_T_sensor) {
  const std::vector<SceneLine> lines = trajectory_lines(map_T_sensor);
  impl_->trajectory.set(lines);
  impl_->trajectory_box_mm.setEmpty();
  for (const SceneLine& line : lines) impl_->trajectory_box_mm.extend(line.from_mm).extend(line.to_mm);
}

void Scene::set_map(const MapSnapshot& map) {
  impl_->keyframes.set(keyframe_lines(map));
  impl_->edges.set(edge_lines(map));
  const cv::Mat4b doubt = doubt_by_keyframe(map, kCertainMm, kUncertainMm);
  fill_texture(impl_->certainty.name(), doubt.cols, doubt.rows, doubt.ptr());
}

Eigen::AlignedBox3f Scene::bounds_mm() const { return impl_->mesh.box_mm(); }

std::optional<Vector3f> Scene::pick(const PickRay& ray) const { return impl_->mesh.pick(ray); }

void Scene::draw(const OrbitCamera& camera, const Viewport& viewport, const SceneStyle& style) {
  const Matrix4f clip_T_camera = camera.projection(viewport.aspect(), impl_->drawn_box());
  const Matrix4f clip_T_map = clip_T_camera * camera.camera_T_map();
  glViewport(viewport.x, viewport.y, viewport.width, viewport.height);
  glScissor(viewport.x, viewport.y, viewport.width, viewport.height);
  glEnable(GL_SCISSOR_TEST);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LEQUAL);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClear(GL_DEPTH_BUFFER_BIT);
  impl_->draw_background();
  impl_->draw_mesh(camera, clip_T_map, style);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  impl_->draw_piece(camera, clip_T_camera);
  if (style.touch) impl_->draw_touch(camera, clip_T_camera);
  glDepthMask(GL_FALSE);
  impl_->draw_all_lines(clip_T_map, viewport, style);
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
  const auto [low, high] = impl_->range(style);
  const bool is_length = style.color == SceneColor::height || style.color == SceneColor::distance;
  const char* unit = is_length ? "mm" : style.color == SceneColor::confidence ? "keyframes" : "";
  return ColorLegend{kTitles[static_cast<int>(style.color)], unit, low, high, colors_of(style.color), {}};
}

}  // namespace gelslam
