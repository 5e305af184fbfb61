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

/// Red, green and blue (sRGB) of each vertex; empty if there are none.
using VertexColors = std::vector<std::array<std::uint8_t, 3>>;

/// Says whether read_mesh() can read a file of this name: PLY, OBJ or STL.
bool is_mesh_name(const std::filesystem::path& path);

/// Returns the unit in which a file of this kind is usually given: millimeters for OBJ and STL (as slicers
/// and CAD programs read them), meters for PLY (as in the public datasets) and glTF (by its specification).
/// It is the default for export and for reading files of other programs.
LengthUnit usual_unit(const std::filesystem::path& path);

/// Returns the unit that write_mesh() noted near the beginning of the file; nothing for files of other
/// programs.
std::optional<LengthUnit> noted_unit(const std::filesystem::path& path);

/// Returns the unit of a file's numbers for read_mesh(): the noted one, else the usual one.
LengthUnit unit_of(const std::filesystem::path& path);

/// Returns the `mm_per_unit` of read_mesh() for a file that may contain no unit: that of `unit` ("mm", "cm",
/// "in" or "m"). Returns nothing if the file contains a unit, does not exist, or if `unit` is empty. Throws
/// Error for any other unit.
std::optional<double> named_unit_mm(const std::filesystem::path& path, const std::string& unit);

/// Returns the number of bytes after the last triangle of a binary STL, which are ignored; 0 for every other
/// file.
std::uintmax_t bytes_behind_mesh(const std::filesystem::path& path);

/// Reads PLY, OBJ or STL, by extension, through Assimp; only PLY files of this program contain confidence.
/// Without `mm_per_unit` the numbers are in unit_of(path). Throws Error when the file is missing, truncated,
/// empty or not a triangle mesh.
Mesh read_mesh(const std::filesystem::path& path, std::optional<double> mm_per_unit = std::nullopt);

/// Writes a mesh as PLY (binary, with normals, confidence and colors if present), through Assimp as OBJ, STL
/// (binary) or GLB, or as XYZ (text: points with normals, no triangles), by extension. The file is complete
/// when it appears, and the unit is noted in it. Identical meshes give identical bytes. OBJ and GLB contain
/// every vertex, but readers may get them in another order. GLB is glTF 2.0 in meters with linear colors, as
/// glTF requires; its node rotates the mesh by 180 degrees about x, so that the touched side faces the viewer
/// (glTF's +z) with the top of the image up. Throws Error when the disk is full, when the extension is
/// unknown, for colors with OBJ or STL, for GLB in millimeters, and for any file but PLY in a build without
/// Assimp.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh, LengthUnit file_unit = LengthUnit::meter,
                const VertexColors& colors = {});

/// Returns the bytes of such a file; `extension` (".ply") determines its kind.
std::string encode_mesh(const Mesh& mesh, const std::string& extension,
                        LengthUnit file_unit = LengthUnit::meter, const VertexColors& colors = {});

}  // namespace gelslam
