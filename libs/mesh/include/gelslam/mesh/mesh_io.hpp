#pragma once

#include <filesystem>
#include <optional>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

enum class LengthUnit { metre, millimetre };

const char* short_name(LengthUnit unit);  ///< "m", "mm"

/// The unit a file of that kind is expected in: millimetres for OBJ and STL (slicers and CAD programs read
/// them so), metres for PLY (the public datasets' unit). What export and the window write by default.
LengthUnit usual_unit(const std::filesystem::path& path);

/// Reads PLY, OBJ or STL (by extension, through Open3D; confidence only from our own PLY). Without
/// `file_unit` the numbers are in the unit that write_mesh() left in the file, else in metres. Throws Error
/// when the file is missing, truncated, empty or not a triangle mesh.
Mesh read_mesh(const std::filesystem::path& path, std::optional<LengthUnit> file_unit = std::nullopt);

/// Writes PLY (binary, with normals and confidence), OBJ or STL (binary), by extension, to a temporary name
/// that is renamed when whole. The unit is noted in the file. Byte-identical for identical meshes. Throws
/// Error when the disk is full or the name unknown.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                LengthUnit file_unit = LengthUnit::metre);

}  // namespace gelslam
