#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/orbit_camera.hpp"

namespace gelslam::viewer::detail {

/// Layout in the GPU's buffer: 24 bytes.
struct PackedVertex {
  Eigen::Vector3f position_mm;
  std::uint32_t normal;  ///< 10 bits each, signed
  /// Mean curvature in 1/mm, positive on ridges; confidence is 0 if the mesh has none.
  Eigen::half curvature, confidence;
  float value;  ///< Keyframe that sees the vertex best, or distance; or kNoValue.
  static void set_attributes();
};

/// Value of a vertex without data, which is drawn gray. It is far below all others, so that interpolated
/// values are gray, too.
inline constexpr float kNoValue = -1e30F;

/// `values` has one entry for each vertex, or is empty.
std::vector<PackedVertex> pack(const Mesh& mesh, const std::vector<float>& values);

/// Rotates a camera so that most of the mesh faces it (for a closed mesh, its broad side), with its long side
/// horizontal, and slightly from the side and above so that depth is visible. Meshes without area leave it
/// unchanged.
void look_at_broad_side(const Mesh& mesh, OrbitCamera& camera);

/// Returns 1, 2 or 5 times a power of ten that exceeds nearly all of the distances; 1 if there are none.
float round_limit_mm(const std::vector<float>& distance_mm);

/// Returns the uncertainty of the keyframes' poses in the red channel, by keyframe id along rows of
/// kUncertaintyColumns: 0 where two standard deviations are `from_mm`, 255 where they are `to_mm`.
cv::Mat4b uncertainty_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm);
inline constexpr int kUncertaintyColumns = 256;

}  // namespace gelslam::viewer::detail
