// Simplifies a mesh by collapsing edges in the order of their quadric error (Garland and Heckbert, SIGGRAPH
// 1997; meshoptimizer). The border is kept. The library takes and returns errors relative to the size of the
// mesh.

#include "gelslam/evaluation/simplify.hpp"

#include <meshoptimizer.h>

#include <vector>

namespace gelslam {

SimplifiedMesh simplify(const Mesh& full, double max_error_mm) {
  std::vector<unsigned> corners;
  for (const Eigen::Vector3i& t : full.triangles)
    for (const int corner : t) corners.push_back(static_cast<unsigned>(corner));
  const float* const vertices = full.vertices_mm.front().data();
  constexpr std::size_t kStride = sizeof(Eigen::Vector3f);
  const float scale_mm = meshopt_simplifyScale(vertices, full.vertices_mm.size(), kStride);
  std::vector<unsigned> remaining(corners.size());
  float relative_error = 0;
  remaining.resize(meshopt_simplify(remaining.data(), corners.data(), corners.size(), vertices,
                                    full.vertices_mm.size(), kStride, /*target_index_count=*/0,
                                    static_cast<float>(max_error_mm) / scale_mm, meshopt_SimplifyLockBorder,
                                    &relative_error));
  if (remaining.empty()) return {full, 0.0};
  std::vector<Eigen::Vector3i> triangles;
  for (std::size_t i = 0; i < remaining.size(); i += 3)
    triangles.push_back(Eigen::Matrix<unsigned, 3, 1>(&remaining[i]).cast<int>());
  return {submesh(full, triangles), static_cast<double>(relative_error * scale_mm)};
}

}  // namespace gelslam
