#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "gelslam/evaluation/triangle_scene.hpp"

namespace gelslam::evaluation::detail {

/// An orthographic camera: orthonormal directions in the mesh's frame (right, up, toward the viewer).
struct View {
  Eigen::Vector3d right, up, toward_viewer;
};

/// What part of the view plane a panel shows; `center_mm` is a point of the mesh's frame at the panel's
/// middle.
struct Framing {
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
  double mm_per_px = 1.0;
  int width_px = 0;
  int height_px = 0;
  double depth_mm = 0.0;  ///< half the depth range around the center
};

/// The direction from which most of the surface faces the viewer, its longest extent upright.
View facing_view(const Mesh& mesh);
/// Turned about the upright axis.
View turned(const View& view, double angle_deg);
/// Shows `main` whole with a margin, and of `other` as much as fits around it. The height follows the
/// content.
Framing frame(const View& view, const Mesh& main, const Mesh& other, int width_px);

/// Area-weighted vertex normals where the mesh has none of its own.
std::vector<Eigen::Vector3f> vertex_normals(const Mesh& mesh);

/// Linear RGB in [0, 1] of the surface at a hit.
using Albedo = std::function<Eigen::Vector3f(const RayHit&)>;

/// Renders with a headlight, a key light from the upper left and ambient occlusion; 2 x 2 samples per pixel;
/// light background. 8-bit BGR. The same bytes whatever the number of threads.
cv::Mat render(const TriangleScene& scene, const View& view, const Framing& framing, const Albedo& albedo);

}  // namespace gelslam::evaluation::detail
