#pragma once

#include <memory>
#include <optional>
#include <string>

#include "arrays.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam::python {

/// A mesh whose vertices are in meters, as files and arrays have them.
struct MetricMesh {
  explicit MetricMesh(Mesh mesh_mm);
  Mesh mesh;                                ///< vertices_mm is empty
  std::vector<Eigen::Vector3f> vertices_m;  ///< the vertices
};

/// A finished run: of reconstruct() or Slam, or one that was read from its folder.
struct PythonRun {
  std::shared_ptr<const Run> run;  ///< null for one that was read
  std::shared_ptr<MetricMesh> mesh;
  std::vector<StampedPose> trajectory;
  RunReport report{};
  std::filesystem::path folder{};  ///< where it was read
};

/// To be called without the GIL.
PythonRun python_run(Run run);
/// What is uncertain about it, as Python warnings. With the GIL.
void warn_of(const PythonRun& run);

}  // namespace gelslam::python
