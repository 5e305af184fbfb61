#pragma once

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/viewer/orbit_camera.hpp"

namespace gelslam::viewer::detail {

/// Turns a camera to where most of the mesh faces it (a closed one: to its broad side), its long side lying,
/// and a little to the side and above, so that depth shows. Meshes without area leave it as it is.
void look_at_broad_side(const Mesh& mesh, OrbitCamera& camera);

}  // namespace gelslam::viewer::detail
