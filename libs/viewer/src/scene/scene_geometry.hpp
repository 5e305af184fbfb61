#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"

namespace gelslam::viewer::detail {

/// A mesh made fit for drawing: every number finite, every index in range, normals there and of unit length.
struct DrawableMesh {
  std::vector<Eigen::Vector3f> vertices_mm, normals;
  std::vector<float> confidence;      ///< 0 where the mesh has none
  std::vector<float> curvature;       ///< mean, 1/mm, positive on ridges
  std::vector<float> value;           ///< keyframe that sees it best, or distance; or kNoValue
  std::vector<std::uint32_t> source;  ///< index of each vertex in the mesh it came from
  std::vector<std::uint32_t> indices;
  Eigen::AlignedBox3f box_mm;
};

/// Leaves out triangles with indices out of range or corners that are not finite or further than 1 km away,
/// and vertices that then belong to none. `values`: one for each vertex of the mesh, else there are none.
DrawableMesh make_drawable(const Mesh& mesh, const std::vector<float>& values = {});

/// The value of a vertex that has none: drawn gray. Far below all others, so that blends with it are gray
/// too.
inline constexpr float kNoValue = -1e30F;

/// As it lies in the GPU's buffer: 24 bytes.
struct PackedVertex {
  float position_mm[3];
  std::uint32_t normal;                 ///< 10 bits each, signed
  std::uint16_t curvature, confidence;  ///< half floats
  float value;                          ///< what colors by number show; or kNoValue
};

std::vector<PackedVertex> pack(const DrawableMesh& mesh);

/// Turns a camera to where most of the mesh faces it (a closed one: to its broad side), its long side lying,
/// and a little to the side and above, so that depth shows. Meshes without area leave it as it is.
void look_at_broad_side(const Mesh& mesh, OrbitCamera& camera);

/// 1, 2 or 5 times a power of ten that nearly all of the distances are below; 1 without any.
float round_limit_mm(std::vector<float> distance_mm);

/// How much a keyframe's place is in doubt, in red, by id along rows of kDoubtColumns: 0 where two standard
/// deviations are `from_mm`, 255 where they are `to_mm`.
cv::Mat4b doubt_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm);
inline constexpr int kDoubtColumns = 256;

}  // namespace gelslam::viewer::detail
