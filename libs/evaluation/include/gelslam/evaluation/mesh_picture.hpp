#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

struct PictureOptions {
  int panel_width_px = 520;
  /// Distance at the upper end of the color bar; 0: the 98th percentile rounded up to 1, 2 or 5 times a
  /// power of ten.
  double color_limit_mm = 0.0;
};

/// One picture (8-bit BGR) of three panels from the same direction and at the same scale: the reconstruction,
/// the true shape, and the reconstruction colored by its distance to the true shape, with a color bar in
/// millimetres. Both meshes are in one frame. Seen from where most of the reconstruction faces the viewer,
/// its long side upright. Throws Error for a mesh without triangles or area.
cv::Mat render_comparison(const Mesh& estimate, const Mesh& truth, const PictureOptions& options = {});

/// One mesh from `views` (1 to 3) directions around its upright axis: an open surface turned a little to both
/// sides, a closed one by thirds of a turn. Insides of open surfaces are gray.
cv::Mat render_mesh_picture(const Mesh& mesh, int views = 3, const PictureOptions& options = {});

/// Writes a PNG to a temporary name that is renamed when whole. Throws Error when it cannot be written.
void write_picture(const std::filesystem::path& path, const cv::Mat& picture);

}  // namespace gelslam
