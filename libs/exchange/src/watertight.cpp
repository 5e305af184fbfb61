// Watertight meshes by screened Poisson reconstruction (Kazhdan & Hoppe 2013; Open3D).
//
// Points with normals are sampled on the source, one per cell of the octree. An open result is trimmed at a
// distance of reach_mm from the source. A closed result keeps the shells that something touched. If the
// reconstruction is not closed, points of the convex hull are added where the object was not touched, and the
// reconstruction is repeated.

#include "gelslam/exchange/watertight.hpp"

#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>
#include <open3d/utility/Logging.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/evaluation/triangle_scene.hpp"

namespace gelslam {
namespace {

namespace o3d = open3d::geometry;

constexpr int kMinDepth = 7, kMaxDepth = 12;  // Depth of the octree: cells of 1/128 to 1/4096 of its edge.
constexpr float kCubeScale = 1.1F;  // Edge of the octree relative to the largest extent; Open3D's default.
constexpr double kReachCells = 4.0;
// Relative to the largest extent: thickness of an object that was touched from one side only.
constexpr double kBackShare = 0.1;
constexpr std::uint64_t kSampleSeed = 3;
constexpr double kMinSamples = 100;  // Open3D crashes with a single point.
constexpr double kMaxSamples = 5e6;  // Needs about 6 GB.

Eigen::Vector3d extent_mm(const o3d::PointCloud& points) {
  return points.GetMaxBound() - points.GetMinBound();
}

/// Returns the interpolated normal of the vertices, or the triangle's own.
Eigen::Vector3d normal_at(const Mesh& mesh, const SurfaceSample& sample) {
  const Eigen::Vector3i& t = mesh.triangles[static_cast<std::size_t>(sample.triangle)];
  const Eigen::Vector3d own = area_normal(mesh, t);
  if (mesh.normals.empty()) return own.normalized();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const auto corners = corners_mm(mesh, t);
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d &b = corners[(k + 1) % 3], &c = corners[(k + 2) % 3];
    const double share = own.dot((b - sample.point_mm).cross(c - sample.point_mm));
    normal += share * mesh.normals[static_cast<std::size_t>(t[static_cast<int>(k)])].cast<double>();
  }
  return normal.normalized();
}

/// Samples about one point with its normal per square of `spacing_mm`.
o3d::PointCloud sampled(const Mesh& mesh, double spacing_mm) {
  const double count = std::ceil(area_mm2(mesh) / (spacing_mm * spacing_mm));
  if (count > kMaxSamples)
    throw Error("the mesh cannot be made watertight: its edges are too short for its area");
  if (!(count >= kMinSamples))
    throw Error("the mesh cannot be made watertight: its area is too small for its extent");
  o3d::PointCloud points;
  for (const SurfaceSample& sample : sample_surface(mesh, static_cast<int>(count), kSampleSeed)) {
    const Eigen::Vector3d normal = normal_at(mesh, sample);
    if (!(normal.norm() > 0.5)) continue;  // Skips NaN and zero normals.
    points.points_.push_back(sample.point_mm);
    points.normals_.push_back(normal);
  }
  return points;
}

/// Depth of an octree with cells of at most `cell_mm`, within bounds, and the resulting width of its cells.
struct Octree {
  int depth = kMinDepth;
  double cell_mm = 0.0;
};

Octree octree_of(double extent, double cell_mm) {
  const double edge_mm = static_cast<double>(kCubeScale) * extent;
  Octree octree;
  while (octree.depth < kMaxDepth && std::ldexp(edge_mm, -octree.depth) > cell_mm) ++octree.depth;
  octree.cell_mm = std::ldexp(edge_mm, -octree.depth);
  return octree;
}

Mesh to_mesh(const o3d::TriangleMesh& found) {
  Mesh mesh;
  for (const Eigen::Vector3d& v : found.vertices_) mesh.vertices_mm.push_back(v.cast<float>());
  mesh.triangles = found.triangles_;
  return mesh;
}

/// Uses one thread, because with more the order of Open3D's sums, and so the result, depends on the
/// scheduling.
Mesh reconstruct(const o3d::PointCloud& points, int depth) {
  const auto [found, density] = o3d::TriangleMesh::CreateFromPointCloudPoisson(
      points, static_cast<std::size_t>(depth), 0.0F, kCubeScale, false, 1);
  return to_mesh(*found);
}

bool is_closed(const Mesh& mesh) {
  o3d::TriangleMesh edges;
  for (const Eigen::Vector3f& v : mesh.vertices_mm) edges.vertices_.push_back(v.cast<double>());
  edges.triangles_ = mesh.triangles;
  constexpr bool kMayHaveBorders = false;
  return !mesh.triangles.empty() && edges.IsEdgeManifold(kMayHaveBorders);
}

/// Returns for each vertex the closest point of the source.
std::vector<ClosestPoint> closest_to(const TriangleScene& source, const Mesh& mesh) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& v : mesh.vertices_mm) points.push_back(v.cast<double>());
  return source.closest(points);
}

std::vector<char> touched_triangles(const Mesh& mesh, const std::vector<ClosestPoint>& closest,
                                    double reach_mm) {
  std::vector<char> touched;
  for (const Eigen::Vector3i& t : mesh.triangles)
    touched.push_back(std::all_of(t.begin(), t.end(), [&](int corner) {
      return closest[static_cast<std::size_t>(corner)].distance_mm <= reach_mm;
    }));
  return touched;
}

Mesh triangles_where(const Mesh& mesh, const std::vector<char>& chosen) {
  std::vector<Eigen::Vector3i> triangles;
  for (std::size_t i = 0; i < chosen.size(); ++i)
    if (chosen[i] != 0) triangles.push_back(mesh.triangles[i]);
  return submesh(mesh, triangles);
}

Mesh trimmed(const Mesh& mesh, const TriangleScene& source, double reach_mm) {
  return triangles_where(mesh, touched_triangles(mesh, closest_to(source, mesh), reach_mm));
}

/// Returns the mesh without shells that nothing touched, which appear as bubbles where points contradict each
/// other.
Mesh touched_shells(const Mesh& mesh, const TriangleScene& source, double reach_mm) {
  const MeshShells shells = find_shells(mesh);
  const std::vector<char> touched = touched_triangles(mesh, closest_to(source, mesh), reach_mm);
  std::vector<char> shell_touched(shells.area_mm2.size(), 0), chosen(touched.size(), 0);
  const auto shell_of = [&](std::size_t i) { return static_cast<std::size_t>(shells.of_triangle[i]); };
  for (std::size_t i = 0; i < touched.size(); ++i)
    if (touched[i] != 0) shell_touched[shell_of(i)] = 1;
  for (std::size_t i = 0; i < touched.size(); ++i) chosen[i] = shell_touched[shell_of(i)];
  return triangles_where(mesh, chosen);
}

/// Returns the convex hull of the points and of the points moved inward by `thickness_mm`, facing outward.
Mesh thick_hull(const o3d::PointCloud& points, double thickness_mm) {
  o3d::PointCloud cloud = points;
  for (std::size_t i = 0; i < points.points_.size(); ++i)
    cloud.points_.push_back(points.points_[i] - thickness_mm * points.normals_[i]);
  const auto hull = std::get<0>(cloud.ComputeConvexHull());
  const Eigen::Vector3d inside = hull->GetCenter();
  Mesh mesh = to_mesh(*hull);
  for (Eigen::Vector3i& t : mesh.triangles)  // Qhull orients triangles in both ways.
    if (area_normal(mesh, t).dot(corners_mm(mesh, t)[0] - inside) < 0) std::swap(t[1], t[2]);
  return mesh;
}

/// Returns the points of `open`, and those of the convex hull where the object was not touched. A point of
/// the hull is left out if the first surface that a ray from it meets inward faces the point, because the
/// object's side there was touched.
o3d::PointCloud with_hull(const Mesh& open, double cell_mm) {
  o3d::PointCloud points = sampled(open, cell_mm);
  const Eigen::Vector3d extent = extent_mm(points);
  const o3d::PointCloud hull = sampled(thick_hull(points, kBackShare * extent.maxCoeff()), cell_mm);
  const TriangleScene surface(open);
  const double length_mm = 2.0 * extent.norm();
  std::vector<char> behind(hull.points_.size(), 0);
  parallel_for_ranges(behind.size(), 1024, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3d& normal = hull.normals_[i];
      const int seen = surface.first_hit(hull.points_[i] + cell_mm * normal, -normal, length_mm);
      behind[i] = seen >= 0 && surface.triangle_normal(seen).dot(normal) > 0.0;
    }
  });
  for (std::size_t i = 0; i < behind.size(); ++i) {
    if (behind[i] != 0) continue;
    points.points_.push_back(hull.points_[i]);
    points.normals_.push_back(hull.normals_[i]);
  }
  return points;
}

void add_normals(Mesh& mesh) {
  mesh.normals.assign(mesh.vertices_mm.size(), Eigen::Vector3f::Zero());
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (const int corner : t)
      mesh.normals[static_cast<std::size_t>(corner)] += area_normal(mesh, t).cast<float>();
  for (Eigen::Vector3f& normal : mesh.normals) normal.normalize();
}

/// Sets confidence to the mean of the nearest triangle's corners, and to 0 where nothing was touched.
void add_confidence(Mesh& mesh, const Mesh& source, const std::vector<ClosestPoint>& closest,
                    double reach_mm) {
  if (source.confidence.empty()) return;
  for (const ClosestPoint& c : closest) {
    const Eigen::Vector3i& t = source.triangles[static_cast<std::size_t>(c.triangle)];
    float sum = 0;
    for (const int corner : t) sum += source.confidence[static_cast<std::size_t>(corner)];
    mesh.confidence.push_back(c.distance_mm <= reach_mm ? sum / 3 : 0.0F);
  }
}

Mesh closed(const Mesh& smooth, const TriangleScene& source, const Octree& octree, ProgressSink& progress) {
  const double reach_mm = kReachCells * octree.cell_mm;
  if (is_closed(smooth)) return touched_shells(smooth, source, reach_mm);
  progress.begin("closing the body", std::nullopt);
  const o3d::PointCloud points = with_hull(trimmed(smooth, source, reach_mm), octree.cell_mm);
  const Octree larger = octree_of(extent_mm(points).maxCoeff(), octree.cell_mm);
  Mesh body = touched_shells(reconstruct(points, larger.depth), source, reach_mm);
  progress.end();
  return body;
}

WatertightMesh watertight_of(const Mesh& touched, bool close, ProgressSink& progress) {
  const TriangleScene source(touched);
  if (!(area_mm2(touched) > 0.0)) throw Error("the mesh has no area: there is nothing to make watertight");
  const double edge_mm = typical_edge_mm(touched);
  progress.begin("making the surface watertight", std::nullopt);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3i& t : touched.triangles)
    for (const Eigen::Vector3d& corner : corners_mm(touched, t)) box.extend(corner);
  const Octree octree = octree_of(box.sizes().maxCoeff(), edge_mm);
  const Mesh smooth = reconstruct(sampled(touched, octree.cell_mm), octree.depth);
  progress.end();
  WatertightMesh result;
  result.reach_mm = kReachCells * octree.cell_mm;
  result.mesh = close ? closed(smooth, source, octree, progress) : trimmed(smooth, source, result.reach_mm);
  if (is_closed(result.mesh)) result.volume_mm3 = volume_mm3(result.mesh);
  if (result.mesh.triangles.empty() || result.volume_mm3 < 0 || (close && result.volume_mm3 == 0))
    throw Error("the mesh cannot be made watertight: its triangles do not face outward");
  add_normals(result.mesh);
  const std::vector<ClosestPoint> closest = closest_to(source, result.mesh);
  add_confidence(result.mesh, touched, closest, result.reach_mm);
  const Mesh near = triangles_where(result.mesh, touched_triangles(result.mesh, closest, result.reach_mm));
  result.touched_share = area_mm2(near) / area_mm2(result.mesh);
  return result;
}

}  // namespace

WatertightMesh make_watertight(const Mesh& touched, bool close, ProgressSink& progress) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  try {
    return watertight_of(touched, close, progress);
  } catch (const std::bad_alloc&) {
    throw Error("there is not enough memory to make the mesh watertight");
  }
}

}  // namespace gelslam
