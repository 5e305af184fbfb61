#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace gelslam {

/// A triangle mesh in millimeters. `normals` and `confidence` are empty or as long as `vertices_mm`;
/// normals point out of the object; confidence is the summed weight of the observations behind a vertex (>=
/// 0). Triangles are counter-clockwise seen from outside.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices_mm;
  std::vector<Eigen::Vector3f> normals;
  std::vector<float> confidence;
  std::vector<Eigen::Vector3i> triangles;
};

std::array<Eigen::Vector3d, 3> corners_mm(const Mesh& mesh, const Eigen::Vector3i& triangle);
/// Returns a normal by the order of the corners, whose length is twice the triangle's area.
Eigen::Vector3d area_normal(const Mesh& mesh, const Eigen::Vector3i& triangle);
double area_mm2(const Mesh& mesh);
/// Returns the volume of a closed mesh in mm³; negative if its triangles are clockwise as seen from outside.
double volume_mm3(const Mesh& mesh);
/// Throws Error when the mesh has no triangle, an index out of range, or a vertex that is not finite or more
/// than 10 m from the origin. There single precision cannot resolve the details of a surface, and a wrong
/// unit is the likely cause.
void check_measurable(const Mesh& mesh);
/// Returns a warning if the size of the mesh is implausible for an object to be touched and suggests a wrong
/// unit: "is 29400 mm large; check its unit". Returns "" from 1 mm to 2 m.
std::string size_warning(const Mesh& mesh);
/// Returns the median edge length in mm, but at least half the edge length of an even mesh with the same area
/// and number of vertices. The area then consists of at most four times as many squares of this size as there
/// are vertices, however uneven the triangles are. 0 without triangles.
double typical_edge_mm(const Mesh& mesh);

/// A cube of space and the surface in it, so that a growing mesh can be drawn by transmitting only what has
/// changed. Neighboring blocks meet without gaps; vertices on a border may be in both.
struct MeshBlock {
  std::int64_t key = 0;       ///< A cube keeps its key as long as the map exists.
  Mesh mesh;                  ///< Map frame, mm; without triangles if the surface has moved out of the cube.
  std::vector<int> keyframe;  ///< For each vertex, the id of the keyframe that sees it best.
};

/// Shells of a mesh: triangles that share a vertex belong to one shell.
struct MeshShells {
  std::vector<int> of_triangle;  ///< Shell of each triangle; shells are numbered by their first triangle.
  std::vector<double> area_mm2;  ///< Area of each shell.
  int largest = -1;              ///< Shell with the largest area; -1 for a mesh without triangles.
  double largest_share = 0;      ///< Fraction of the total area.
};

MeshShells find_shells(const Mesh& mesh);

/// Returns the largest shell with the vertices that it uses, in their order.
Mesh largest_shell(const Mesh& mesh);

/// Returns some triangles of a mesh (given by their vertices) with the vertices that they use, in their
/// order.
Mesh submesh(const Mesh& mesh, const std::vector<Eigen::Vector3i>& triangles);

}  // namespace gelslam
