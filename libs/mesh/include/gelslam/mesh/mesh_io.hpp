#pragma once

#include <filesystem>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

enum class LengthUnit { metre, millimetre };

/// Reads PLY, OBJ or STL (by extension, through Open3D; confidence only from our own PLY). The file's numbers
/// are taken to be in `file_unit`. Throws Error when the file is missing, truncated, empty or not a triangle
/// mesh.
Mesh read_mesh(const std::filesystem::path& path, LengthUnit file_unit = LengthUnit::metre);

/// Writes PLY (binary, with normals and confidence), OBJ or STL (binary), by extension, to a temporary name
/// that is renamed when whole. Byte-identical for identical meshes. Throws Error when the disk is full or the
/// name unknown.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                LengthUnit file_unit = LengthUnit::metre);

}  // namespace gelslam
