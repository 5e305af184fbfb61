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
/// By the corners' order; as long as twice the triangle's area.
Eigen::Vector3d area_normal(const Mesh& mesh, const Eigen::Vector3i& triangle);
double area_mm2(const Mesh& mesh);
/// Volume of a closed mesh, mm³; negative when its triangles are clockwise seen from outside.
double volume_mm3(const Mesh& mesh);
/// Throws Error when the mesh has no triangle, an index out of range, or a vertex that is not finite or more
/// than 10 m from the origin: there single precision no longer tells near triangles apart, and a wrong unit
/// is the likely reason.
void check_measurable(const Mesh& mesh);
/// What is wrong with the size of a thing that a touch sensor should feel, and a wrong unit explains: "is
/// 29400 mm large; check its unit". "" from 1 mm to 2 m.
std::string size_warning(const Mesh& mesh);
/// Median length of the triangles' sides, mm, but at least half the side in an even mesh of the same area and
/// as many vertices: the area in squares of this size is at most four times as many, however unlike the
/// triangles are. 0 without triangles.
double typical_edge_mm(const Mesh& mesh);

/// A cube of space and the surface in it, so that a growing mesh can be drawn by sending only what changed.
/// Neighboring blocks meet without gaps; vertices on a border may belong to both.
struct MeshBlock {
  std::int64_t key = 0;       ///< the same cube has the same key as long as the map lives
  Mesh mesh;                  ///< map frame, mm; without triangles when the surface has left the cube
  std::vector<int> keyframe;  ///< per vertex: id of the keyframe that sees it best
};

/// Shells of a mesh: triangles that share a vertex belong to one shell.
struct MeshShells {
  std::vector<int> of_triangle;  ///< the shell of each triangle, counted by its first triangle
  std::vector<double> area_mm2;  ///< of each shell
  int largest = -1;              ///< by area; -1 for a mesh without triangles
  double largest_share = 0;      ///< of the area
};

MeshShells find_shells(const Mesh& mesh);

/// The largest shell alone, with the vertices that it uses, in their order.
Mesh largest_shell(const Mesh& mesh);

/// Some triangles of a mesh (three vertices each), with the vertices that they use, in their order.
Mesh submesh(const Mesh& mesh, const std::vector<Eigen::Vector3i>& triangles);

}  // namespace gelslam
