#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"
#include "gelslam/viewer/scene_style.hpp"
#include "scene/scene_lines.hpp"
#include "scene/scene_mesh.hpp"
#include "scene/scene_shaders.hpp"
#include "scene/scene_touch.hpp"

namespace gelslam::viewer::detail {

/// The displayed scene: a growing mesh, the touch on it, the path of the sensor and the pose graph, in mm in
/// the map frame. All functions need the OpenGL context in which it was created to be current, on one thread.
class Scene {
 public:
  /// Replaces blocks with the same key; empty blocks remove them. Only these blocks are sent to the GPU.
  void update(const MeshFeed::Changes& changes);
  /// Sets the whole mesh. `distance_mm` is the distance of each vertex to another surface, for
  /// SceneColor::distance; if it is empty, the mesh is drawn in gray.
  void set_mesh(const Mesh& mesh, const std::vector<float>& distance_mm = {});

  void set_touch(TouchPatch touch);
  /// Sets the surface of a component that is not part of the map yet; it has its own color.
  void set_unjoined(const TouchMesh& mesh);
  void place_unjoined(const std::optional<Pose>& map_T_unjoined) {
    map_T_unjoined_ = map_T_unjoined;
  }  ///< Empty: hides it.
  /// Sets the path as sequences of sensor poses, which are not connected to each other.
  void set_trajectory(const std::vector<std::vector<Pose>>& map_T_sensor);
  /// Keyframes and edges of the shown component.
  void set_map(const MapSnapshot& map);

  Eigen::AlignedBox3f bounds_mm() const { return mesh_.box_mm(); }  ///< Empty without triangles.
  /// Returns the first intersection of the ray with the mesh.
  std::optional<Eigen::Vector3f> pick(const PickRay& ray) const { return mesh_.pick(ray); }

  /// Draws into that part of the current framebuffer, background included. It sets the GL state that it
  /// needs, and leaves depth test, blending, culling and scissor off and no program or vertex array bound.
  void draw(const OrbitCamera& camera, const Viewport& viewport, const SceneStyle& style);

  /// Returns the legend of the colors that `style` gives the mesh; nothing for a plain color.
  std::optional<ColorLegend> legend(const SceneStyle& style) const;

 private:
  Eigen::AlignedBox3f drawn_box() const;
  std::array<float, 2> range(const SceneStyle& style) const;
  void draw_background();
  void draw_mesh(const Eigen::Matrix4f& clip_T_map, const Eigen::Matrix4f& camera_T_map,
                 const SceneStyle& style);
  void draw_unjoined(const Eigen::Matrix4f& clip_T_camera, const Eigen::Matrix4f& camera_T_map);
  void draw_touch(const Eigen::Matrix4f& clip_T_camera, const Eigen::Matrix4f& camera_T_map);
  void draw_lines(const SceneLines& lines);
  void draw_all_lines(const Eigen::Matrix4f& clip_T_map, const Viewport& viewport, const SceneStyle& style);

  GlProgram mesh_program_{kMeshVertexShader, kMeshFragmentShader};
  GlProgram touch_program_{kTouchVertexShader, kTouchFragmentShader};
  GlProgram line_program_{kLineVertexShader, kLineFragmentShader};
  GlProgram background_program_{kBackgroundVertexShader, kBackgroundFragmentShader};
  GlVertexArray no_vertices_;
  /// `certainty_` is indexed by keyframe id as uncertainty_by_keyframe().
  GlTexture color_map_, certainty_;
  SceneColor color_map_for_ = SceneColor::plain;
  SceneMesh mesh_;
  GlTriangles touch_mesh_, unjoined_;
  SceneLines outline_, trajectory_, keyframes_, edges_;
  std::optional<Pose> map_T_unjoined_;
  Eigen::AlignedBox3f unjoined_box_mm_;  ///< In its own frame.
  TouchPatch touch_;
  Eigen::AlignedBox3f trajectory_box_mm_;
  float distance_limit_mm_ = 1;
};

}  // namespace gelslam::viewer::detail
