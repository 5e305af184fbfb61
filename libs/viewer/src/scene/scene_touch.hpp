#pragma once

#include <Eigen/Core>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/surface.hpp"
#include "scene/scene_lines.hpp"

namespace gelslam::viewer::detail {

/// The frame that touches now; nothing without places.
struct TouchPatch {
  struct Place {
    Pose map_T_sensor = Pose::Identity();
    double opacity = 1.0;  ///< in [0, 1]; below 1 it shows through the object, too
  };
  SurfacePtr surface{};
  double gradient_scale = 1.0;  ///< heights are divided by it (backend/pose_graph.hpp)
  std::vector<Place> places{};  ///< where it may be
};

/// The contact of one frame as a small height field in the sensor frame.
struct TouchMesh {
  struct Vertex {
    Eigen::Vector3f position_mm, normal;  ///< out of the object
    float inside;                         ///< 0 at the contact's border to 1 well inside; below 0 outside
    static void set_attributes();
  };
  std::vector<Vertex> vertices;
  std::vector<Eigen::Vector3i> triangles;  ///< counter-clockwise from outside
};

/// Every second pixel of a large contact, all of a small one. Pixels that are not finite are left out.
TouchMesh make_touch_mesh(const Surface& surface, double gradient_scale);

TouchMesh make_touch_mesh(const std::vector<TouchedSquare>& squares);

/// The sensor's field of view at each place.
std::vector<SceneLine> sensor_outlines(const TouchPatch& touch);

}  // namespace gelslam::viewer::detail
