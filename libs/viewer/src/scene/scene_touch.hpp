#pragma once

#include <Eigen/Core>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/surface.hpp"
#include "scene/scene_lines.hpp"

namespace gelslam::viewer::detail {

/// The touch of the current frame; it is not shown if there are no places.
struct TouchPatch {
  struct Place {
    Pose map_T_sensor = Pose::Identity();
    double opacity = 1.0;  ///< In [0, 1]; below 1 it is also visible through the object.
  };
  SurfacePtr surface{};
  double gradient_scale = 1.0;  ///< Heights are divided by it (backend/uncertain_motion.hpp).
  std::vector<Place> places{};  ///< Possible poses.
};

/// The contact of one frame as a small height field in the sensor's frame.
struct TouchMesh {
  struct Vertex {
    Eigen::Vector3f position_mm, normal;  ///< Points out of the object.
    float inside;                         ///< 0 at the contact's border, 1 well inside it, negative outside.
    static void set_attributes();
  };
  std::vector<Vertex> vertices;
  std::vector<Eigen::Vector3i> triangles;  ///< Counter-clockwise as seen from outside.
};

/// Makes a mesh from every second pixel of a large contact, or all pixels of a small one. Pixels that are not
/// finite are left out.
TouchMesh make_touch_mesh(const Surface& surface, double gradient_scale);

TouchMesh make_touch_mesh(const std::vector<TouchedSquare>& squares);

/// Returns the outline of the sensor's field of view at each pose.
std::vector<SceneLine> sensor_outlines(const TouchPatch& touch);

}  // namespace gelslam::viewer::detail
