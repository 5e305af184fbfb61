#pragma once

#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// Loose pieces of a mesh: triangles that share a vertex are of one piece.
struct MeshPieces {
  std::vector<int> of_triangle;  ///< the piece of each triangle, counted by its first triangle
  std::vector<double> area_mm2;  ///< of each piece
  int largest = -1;              ///< by area; -1 for a mesh without triangles
  double largest_share = 0;      ///< of the area
};

MeshPieces find_pieces(const Mesh& mesh);

/// The largest piece alone, with the vertices that it uses, in their order.
Mesh largest_piece(const Mesh& mesh);

/// Some triangles of a mesh (three vertices each), with the vertices that they use, in their order.
Mesh submesh(const Mesh& mesh, const std::vector<Eigen::Vector3i>& triangles);

}  // namespace gelslam
