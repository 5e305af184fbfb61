#pragma once

#include <cstdint>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/evaluation/triangle_scene.hpp"

namespace gelslam {

struct DistanceSummary {
  double mean_mm = 0.0;
  double median_mm = 0.0;
  double p90_mm = 0.0;
  double p95_mm = 0.0;
};

/// Fraction of the reconstruction within a distance of the true surface (precision), fraction of the truth's
/// points within that distance of the reconstruction (completeness), and their harmonic mean.
struct ShareWithin {
  double distance_mm = 0.0;
  double precision = 0.0;
  double completeness = 0.0;
  double f_score = 0.0;
};

struct MeshMetrics {
  DistanceSummary accuracy;  ///< Distances from the reconstruction to the true surface (distances_from()).
  DistanceSummary completeness;     ///< Distances from the truth's points to the reconstructed surface.
  std::vector<ShareWithin> within;  ///< For 0.05, 0.1 and 0.25 mm.
  /// Median angle between the normals of the reconstruction and those of the true surface at the nearest
  /// point. For normals_aside_deg, each point of the reconstruction is first moved by 1 mm within its tangent
  /// plane. If the true surface belongs to another object, the first angle is not smaller than the second.
  double normals_deg = 0, normals_aside_deg = 0;
};

struct SurfaceSample {
  Eigen::Vector3d point_mm;
  int triangle;
};

/// Returns `count` points distributed over the mesh in proportion to area (systematic sampling along the
/// cumulated area of the triangles). The same seed gives the same points. Throws Error when the mesh has no
/// area.
std::vector<SurfaceSample> sample_surface(const Mesh& mesh, int count, std::uint64_t seed);

std::vector<Eigen::Vector3d> sample_points(const std::vector<SurfaceSample>& samples);

/// Returns the point-to-triangle distances from a surface, weighted by area, to `target`. Throws Error when
/// the surface has no area.
DistanceSummary distances_from(const Mesh& surface, const TriangleScene& target);

/// Returns the area (mm²) of a surface around those vertices that are the nearest one of any of the points.
double area_around(const std::vector<Eigen::Vector3d>& points_mm, const TriangleScene& surface);

/// Returns the mesh with its vertices and normals transformed by a pose.
Mesh transformed(const Mesh& mesh, const Pose& target_T_mesh);

/// Evaluates a reconstruction in the truth's frame: its distances to the true surface, and the distances of
/// `truth_points_mm` (touched points, or samples of the whole surface) to it. Point-to-triangle; no scale and
/// no alignment are estimated.
MeshMetrics evaluate_mesh(const TriangleScene& estimate, const TriangleScene& truth,
                          const std::vector<Eigen::Vector3d>& truth_points_mm);

/// A rigid refinement, with its size: the shift of the mesh's center and the rotation angle.
struct Refinement {
  Pose truth_T_estimate = Pose::Identity();
  double shift_mm = 0.0;
  double rotation_deg = 0.0;
};

/// Aligns the reconstruction with the true surface by rigid point-to-plane ICP (Chen & Medioni 1992) with
/// Huber weights, starting at identity. The pose is not changed along directions that the surface does not
/// determine (such as sliding on a plane or rotating a ball). The mean distance at the end is never larger
/// than at the beginning.
Refinement refine_rigidly(const TriangleScene& estimate, const TriangleScene& truth);

}  // namespace gelslam
