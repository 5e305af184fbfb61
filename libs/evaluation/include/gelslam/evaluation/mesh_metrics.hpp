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

/// The share of the reconstruction within a distance of the truth, the share of the truth's points within
/// that distance of the reconstruction, and their harmonic mean.
struct ShareWithin {
  double distance_mm = 0.0;
  double precision = 0.0;
  double completeness = 0.0;
  double f_score = 0.0;
};

struct MeshMetrics {
  DistanceSummary accuracy;         ///< distances_from() the reconstruction to the true surface
  DistanceSummary completeness;     ///< from the truth's points to the reconstructed surface
  std::vector<ShareWithin> within;  ///< at 0.05, 0.1 and, the largest, 0.25 mm
  /// Median angle between normals of the reconstruction and of the true surface nearby; and the same with the
  /// reconstruction moved along itself by 1 mm: no larger where the relief is another.
  double normals_deg = 0, normals_aside_deg = 0;
};

struct SurfaceSample {
  Eigen::Vector3d point_mm;
  int triangle;
};

/// `count` points spread over the mesh in proportion to area (systematic sampling along the triangles'
/// cumulated area; same seed, same points). Throws Error when the mesh has no area.
std::vector<SurfaceSample> sample_surface(const Mesh& mesh, int count, std::uint64_t seed);

std::vector<Eigen::Vector3d> sample_points(const std::vector<SurfaceSample>& samples);

/// Distances of a surface, area-weighted, to `target`. Point-to-triangle. Throws Error when it has no area.
DistanceSummary distances_from(const Mesh& surface, const TriangleScene& target);

/// Area of a surface around those vertices that are nearest to one of the points, mm².
double area_around(const std::vector<Eigen::Vector3d>& points_mm, const TriangleScene& surface);

/// The mesh with its vertices and normals moved by a pose.
Mesh transformed(const Mesh& mesh, const Pose& target_T_mesh);

/// Distances of a reconstruction, already placed in the truth's frame, to the true surface, and of
/// `truth_points_mm` (points really touched, or samples of the whole surface) to it. Point-to-triangle, no
/// scale, no alignment.
MeshMetrics evaluate_mesh(const TriangleScene& estimate, const TriangleScene& truth,
                          const std::vector<Eigen::Vector3d>& truth_points_mm);

/// The size of a rigid refinement: how far it moves the mesh's center, and by what angle it turns the mesh.
struct Refinement {
  Pose truth_T_estimate = Pose::Identity();
  double shift_mm = 0.0;
  double rotation_deg = 0.0;
};

/// Rigid point-to-plane ICP of the reconstruction onto the true surface, Huber weights, started at identity.
/// Directions that the surface does not determine (sliding on a plane, turning a ball) are left alone. Never
/// ends at a larger mean distance than it began with. Source: Chen & Medioni 1992; own implementation.
Refinement refine_rigidly(const TriangleScene& estimate, const TriangleScene& truth);

}  // namespace gelslam
