#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

struct Config;

struct MeshMapOptions {
  CameraModel camera{{320, 240}, 0.0634};  ///< of the sensor
  /// Depth to which the sensor is pressed into the surface; typical of a hand.
  double indentation_mm = 0.6;
  int max_touches = 2000;  ///< bounds the time: about 0.1 s each on one core
};

/// Returns the camera of a configured sensor for MeshMapOptions. Optics that are stored in the sensor's
/// gradient model are not included.
CameraModel configured_camera(const Config& config);

struct MeshMap {
  std::vector<PosedSurface> patches;  ///< in the mesh's frame
  /// Fraction of the surface that lies well inside the contact of a simulated touch.
  double covered_share = 0;
  /// Empty, or a sentence for the user: that max_touches do not cover the mesh, or that its triangles face
  /// both ways.
  std::string warning;
};

/// Makes the map of an object that was never touched: simulates from a closed mesh (mm) what the gel would
/// show. The touches are spread over the surface so that one of them is near, wherever the sensor is pressed
/// on along the normal. The result does not depend on the number of threads. Throws Error for an option out
/// of range; for a mesh of implausible size, without area or with indices out of range; and when no touch has
/// contact. Available only in builds with the simulation.
MeshMap make_mesh_map(const Mesh& mesh, const MeshMapOptions& options, ProgressSink& progress);

/// Reads the surfaces of a map with their poses in the map's frame, from a run folder or from a folder that
/// `gelslam map` wrote. Throws Error when there is no map, or when it is damaged.
MapSnapshot read_map(const std::filesystem::path& folder);

/// Throws Error unless the map's surfaces have the given pixel pitch, because surfaces of another pitch would
/// never be recognized. `name` stands for the map in messages.
void check_pixel_pitch(const std::vector<PosedSurface>& map, double pixel_pitch_mm, const std::string& name);

/// Writes a map of simulated touches as a folder that read_map() and the viewer can read: session.db,
/// mesh.ply (`mesh`), keyframes.tum and trajectory.tum (the touches, one per second), and map.json, which
/// marks the folder as a map and names its `source`. Throws Error when a file cannot be written.
void write_map(const std::filesystem::path& folder, const MeshMap& map, const Mesh& mesh,
               const std::string& source);

/// Returns the options with which to create the RunFolder for write_map(). `source` is the mesh's file, which
/// must not be overwritten.
RunFolderOptions map_folder_options(const std::filesystem::path& source, bool overwrite);

}  // namespace gelslam
