#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"

namespace gelslam::viewer::detail {

/// As it lies in the GPU's buffer: 24 bytes.
struct PackedVertex {
  Eigen::Vector3f position_mm;
  std::uint32_t normal;               ///< 10 bits each, signed
  Eigen::half curvature, confidence;  ///< mean, 1/mm, positive on ridges; 0 where the mesh has none
  float value;                        ///< keyframe that sees it best, or distance; or kNoValue
  static void set_attributes();
};

/// The value of a vertex that has none: drawn gray. Far below all others, so that blends with it are gray
/// too.
inline constexpr float kNoValue = -1e30F;

/// `values`: one for each vertex of the mesh, or none.
std::vector<PackedVertex> pack(const Mesh& mesh, const std::vector<float>& values);

/// Turns a camera to where most of the mesh faces it (a closed one: to its broad side), its long side lying,
/// and a little to the side and above, so that depth shows. Meshes without area leave it as it is.
void look_at_broad_side(const Mesh& mesh, OrbitCamera& camera);

/// 1, 2 or 5 times a power of ten that nearly all of the distances are below; 1 without any.
float round_limit_mm(const std::vector<float>& distance_mm);

/// How much a keyframe's place is uncertain, in red, by id along rows of kUncertaintyColumns: 0 where two
/// standard deviations are `from_mm`, 255 where they are `to_mm`.
cv::Mat4b uncertainty_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm);
inline constexpr int kUncertaintyColumns = 256;

}  // namespace gelslam::viewer::detail
