#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"
#include "gelslam/viewer/scene_style.hpp"

namespace gelslam {

namespace viewer::detail {
struct TouchMesh;
}

/// The frame that touches now.
struct TouchPatch {
  struct Ghost {
    Pose map_T_sensor = Pose::Identity();
    double opacity = 1.0;  ///< of the touch drawn there, in [0, 1]; below 1 it shows through the object, too
  };
  SurfacePtr surface;
  Pose map_T_sensor = Pose::Identity();
  double gradient_scale = 1.0;  ///< heights are divided by it (backend/pose_graph.hpp)
  double opacity = 1.0;
  std::vector<Ghost> ghosts{};  ///< where else it may be
};

/// What is to be seen: a growing mesh, the touch on it, the way of the sensor and the pose graph. Map frame,
/// mm. Everything needs the context it was made with to be current, one thread.
class Scene {
 public:
  Scene();
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// Blocks replace those with the same key; empty ones remove them. Only these are sent to the GPU.
  /// Triangles with indices out of range, or corners that are not finite or further than 1 km away, are left
  /// out; missing normals are made.
  void update(const MeshFeed::Changes& changes);
  /// The whole mesh at once. `distance_mm`: of each vertex to another surface, which SceneColor::distance
  /// shows; NaN, or none at all, is drawn gray.
  void set_mesh(const Mesh& mesh, const std::vector<float>& distance_mm = {});

  void set_touch(std::optional<TouchPatch> touch);
  /// What was touched and is not part of the map yet, drawn in a color of its own.
  void set_piece(const viewer::detail::TouchMesh& mesh);
  void place_piece(const std::optional<Pose>& map_T_piece);  ///< nothing: it is not drawn
  /// Stretches of tracking, each a chain of sensor poses; they are not joined.
  void set_trajectory(const std::vector<std::vector<Pose>>& map_T_sensor);
  /// Keyframes and edges of the shown component.
  void set_map(const MapSnapshot& map);

  Eigen::AlignedBox3f bounds_mm() const;  ///< of the mesh; empty without triangles
  /// Where the ray first meets the mesh.
  std::optional<Eigen::Vector3f> pick(const PickRay& ray) const;

  /// Draws into that part of the framebuffer now bound, background included. Sets the GL state it needs, and
  /// leaves depth test, blending, culling and scissor off and no program or vertex array bound.
  void draw(const OrbitCamera& camera, const Viewport& viewport, const SceneStyle& style);

  /// The meaning of the colors that `style` gives the mesh, or nothing for plain color.
  std::optional<ColorLegend> legend(const SceneStyle& style) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
