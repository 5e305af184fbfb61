#pragma once

#include <memory>
#include <optional>
#include <string>

#include "arrays.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam::python {

/// A mesh whose vertices are in meters, as in files and arrays.
struct MetricMesh {
  explicit MetricMesh(Mesh mesh_mm);
  Mesh mesh;                                ///< Its vertices_mm is empty.
  std::vector<Eigen::Vector3f> vertices_m;  ///< The vertices in meters.
};

/// A finished run, from reconstruct() or Slam or read from its folder.
struct PythonRun {
  std::shared_ptr<const Run> run;  ///< Null for a run that was read.
  std::shared_ptr<MetricMesh> mesh;
  std::vector<StampedPose> trajectory;
  RunReport report{};
  std::filesystem::path folder{};  ///< Folder from which it was read.
};

/// To be called without the GIL.
PythonRun python_run(Run run);
/// Issues the run's warnings as Python warnings. The GIL must be held.
void warn_of(const PythonRun& run);

}  // namespace gelslam::python
