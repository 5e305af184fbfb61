#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

enum class LengthUnit { meter, millimeter };

const char* short_name(LengthUnit unit);  ///< "m", "mm"

/// Per vertex red, green, blue (sRGB); empty: none.
using VertexColors = std::vector<std::array<std::uint8_t, 3>>;

/// Whether read_mesh() takes a file of this name: PLY, OBJ or STL.
bool is_mesh_name(const std::filesystem::path& path);

/// The unit a file of that kind is expected in: millimeters for OBJ and STL (slicers and CAD programs read
/// them so), meters for PLY (the public datasets' unit) and glTF (its specification). What export and the
/// window write by default, and how files of other programs are read.
LengthUnit usual_unit(const std::filesystem::path& path);

/// The unit that write_mesh() noted near the beginning of the file; nothing in files of other programs.
std::optional<LengthUnit> noted_unit(const std::filesystem::path& path);

/// The unit in which read_mesh() takes the numbers of a file by default: the noted one, else the usual one.
LengthUnit unit_of(const std::filesystem::path& path);

/// The `mm_per_unit` of read_mesh() for a file that may note no unit: that of `unit` ("mm", "cm", "in" or
/// "m"). Nothing where the file notes one, is none, or `unit` is empty. Throws Error for another unit.
std::optional<double> named_unit_mm(const std::filesystem::path& path, const std::string& unit);

/// Bytes behind the last triangle of a binary STL, which are ignored; 0 for every other file.
std::uintmax_t bytes_behind_mesh(const std::filesystem::path& path);

/// Reads PLY, OBJ or STL (by extension, through Assimp; confidence only from our own PLY). Without
/// `mm_per_unit` the numbers are in unit_of(path). Throws Error when the file is missing, truncated, empty or
/// not a triangle mesh.
Mesh read_mesh(const std::filesystem::path& path, std::optional<double> mm_per_unit = std::nullopt);

/// Writes PLY (binary, with normals, confidence and colors as far as there are any) or, through Assimp, OBJ,
/// STL (binary) or GLB, or XYZ (text: points with normals, no triangles), by extension, to a temporary name
/// that is renamed when whole. The unit is noted in the file. Byte-identical for identical meshes. Readers of
/// OBJ and GLB find every vertex, but may find them in another order. GLB is glTF 2.0: meters, colors linear
/// (as glTF has them); the node turns the mesh by 180 degrees about x: what the sensor touched then faces the
/// viewer (glTF's +z), the top of the picture up. Throws Error when the disk is full, the name unknown,
/// colors are given for OBJ or STL, GLB is asked for in millimeters, or this build is without Assimp and the
/// file no PLY.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh, LengthUnit file_unit = LengthUnit::meter,
                const VertexColors& colors = {});

/// The bytes of such a file, `extension` (".ply") says of which kind.
std::string encode_mesh(const Mesh& mesh, const std::string& extension,
                        LengthUnit file_unit = LengthUnit::meter, const VertexColors& colors = {});

}  // namespace gelslam
