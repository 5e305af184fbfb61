#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// Pictures of whole meshes (8-bit BGR, light background), drawn without a window. Each function makes its
/// own context and leaves none current. They throw Error where neither EGL nor a hidden window works, and for
/// a mesh without area.

/// Three panels from the same direction at the same scale: the reconstruction, the true shape, and the
/// reconstruction colored by its distance to the true shape, with the meaning of the colors in millimeters.
/// Both meshes are in one frame. Seen from where most of the reconstruction faces the viewer.
cv::Mat3b draw_comparison(const Mesh& estimate, const Mesh& truth, int panel_width_px = 560);

/// The mesh from three sides: from where most of it faces the viewer and, around its upright axis, from left
/// and right (an open surface turned a little, a closed one by thirds of a turn).
cv::Mat3b draw_mesh(const Mesh& mesh, int panel_width_px = 560);

/// Writes a PNG to a temporary name that is renamed when whole. Throws Error when it cannot be written.
void write_picture(const std::filesystem::path& path, const cv::Mat& picture);

}  // namespace gelslam
