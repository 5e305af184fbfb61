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
  double indentation_mm = 0.6;             ///< how deep the sensor is pressed on; typical of a hand
  int max_touches = 2000;                  ///< bounds the time: about 0.1 s each on one core
};

/// The camera of a configured sensor, for MeshMapOptions. The optics that its model states are not known.
CameraModel configured_camera(const Config& config);

struct MeshMap {
  std::vector<PosedSurface> patches;  ///< in the mesh's frame
  double covered_share = 0;           ///< share of the surface that lies well inside a touch
  std::string warning;  ///< when max_touches do not cover all, as a sentence for the user; or ""
};

/// A map of an object that was never touched: what the gel would show, simulated from a closed mesh (mm), at
/// touches spread over its surface so that wherever the sensor is pressed on along the normal, one of them is
/// near. Deterministic for any number of threads. Throws Error for meshes that cannot be measured (as
/// evaluate() does), have no area or touch nowhere. Only in builds with the simulation.
MeshMap make_mesh_map(const Mesh& mesh, const MeshMapOptions& options, ProgressSink& progress);

/// The surfaces of a map, at their places in its frame: of a run folder, or of a folder that `gelslam map`
/// made. Throws Error when there is none, or it is damaged.
MapSnapshot read_map(const std::filesystem::path& folder);

/// Throws Error unless a map's surfaces have this pixel pitch: those of another one would never be found.
/// `name` stands for the map in messages.
void check_pixel_pitch(const std::vector<PosedSurface>& map, double pixel_pitch_mm, const std::string& name);

/// Writes a map of touches as a folder that read_map() and the viewer understand: session.db, mesh.ply (its
/// mesh), keyframes.tum and trajectory.tum (the touches, one per second) and map.json, which says that it is
/// one. Throws Error when the disk is full.
void write_map(const std::filesystem::path& folder, const MeshMap& map, const Mesh& mesh,
               const std::string& source);

/// Options of the RunFolder for write_map(). `source`: the mesh's file, which must not be replaced.
RunFolderOptions map_folder_options(const std::filesystem::path& source, bool overwrite);

}  // namespace gelslam
