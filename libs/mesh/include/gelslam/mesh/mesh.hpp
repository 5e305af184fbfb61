#pragma once

#include <Eigen/Core>
#include <vector>

namespace gelslam {

/// A triangle mesh in millimetres. `normals` and `confidence` are empty or as long as `vertices_mm`;
/// normals point out of the object; confidence is the summed weight of the observations behind a vertex (>=
/// 0). Triangles are counter-clockwise seen from outside.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices_mm;
  std::vector<Eigen::Vector3f> normals;
  std::vector<float> confidence;
  std::vector<Eigen::Vector3i> triangles;
};

}  // namespace gelslam
