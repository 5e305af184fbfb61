#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/localization/mesh_map.hpp"
#include "gelslam/slam/session.hpp"

namespace gelslam {

/// The surfaces of a map, at their places in its frame: of a run folder, of the session in it, or of a folder
/// that `gelslam map` made. Throws Error when there is none, or it is damaged.
Session read_map(const std::filesystem::path& folder);

/// Writes a map of touches as a folder that read_map() and the viewer understand: session/, mesh.ply (its
/// mesh), keyframes.tum and trajectory.tum (the touches, one per second) and map.json, which says that it is
/// one. Throws Error when the disk is full.
void write_map(const std::filesystem::path& folder, const MeshMap& map, const Mesh& mesh,
               const std::string& source);

/// Everything that write_map() writes.
std::vector<std::string> map_entries();
inline constexpr const char* kMapMarker = "map.json";

}  // namespace gelslam
