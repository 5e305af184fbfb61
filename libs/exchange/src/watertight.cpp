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

constexpr int kMinDepth = 7, kMaxDepth = 12;  // of the octree: cells of 1/128 to 1/4096 of its edge
constexpr float kCubeScale = 1.1F;            // the octree's edge over the largest extent; Open3D's default
constexpr double kReachCells = 4.0;
constexpr double kBackShare = 0.1;  // of the largest extent: thickness of what was touched from one side
constexpr std::uint64_t kSampleSeed = 3;
constexpr double kMinSamples = 100;  // Open3D crashes with one
constexpr double kMaxSamples = 5e6;  // about 6 GB

struct OrientedPoint {
  Eigen::Vector3d point_mm;
  Eigen::Vector3d normal;
};

Eigen::Vector3d corner_mm(const Mesh& mesh, const Eigen::Vector3i& triangle, int k) {
  return mesh.vertices_mm[static_cast<std::size_t>(triangle[k])].cast<double>();
}

/// By the corners' order; as long as twice the triangle's area.
Eigen::Vector3d area_normal(const Mesh& mesh, const Eigen::Vector3i& t) {
  const Eigen::Vector3d a = corner_mm(mesh, t, 0);
  return (corner_mm(mesh, t, 1) - a).cross(corner_mm(mesh, t, 2) - a);
}

Eigen::Vector3d extent_mm(const std::vector<OrientedPoint>& points) {
  Eigen::AlignedBox3d box;
  for (const OrientedPoint& p : points) box.extend(p.point_mm);
  return box.sizes();
}

/// The vertices' normals between the corners, or the triangle's own.
Eigen::Vector3d normal_at(const Mesh& mesh, const SurfaceSample& sample) {
  const Eigen::Vector3i& t = mesh.triangles[static_cast<std::size_t>(sample.triangle)];
  const Eigen::Vector3d own = area_normal(mesh, t);
  if (mesh.normals.empty()) return own.normalized();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d b = corner_mm(mesh, t, (k + 1) % 3), c = corner_mm(mesh, t, (k + 2) % 3);
    const double share = own.dot((b - sample.point_mm).cross(c - sample.point_mm));
    normal += share * mesh.normals[static_cast<std::size_t>(t[k])].cast<double>();
  }
  return normal.normalized();
}

/// About one point per square of `spacing_mm`.
std::vector<OrientedPoint> sampled(const Mesh& mesh, double spacing_mm) {
  const double count = std::ceil(area_mm2(mesh) / (spacing_mm * spacing_mm));
  if (count > kMaxSamples)
    throw Error("the mesh cannot be made watertight: its edges are too short for its area");
  if (!(count >= kMinSamples))
    throw Error("the mesh cannot be made watertight: its area is too small for its extent");
  std::vector<OrientedPoint> points;
  points.reserve(static_cast<std::size_t>(count));
  for (const SurfaceSample& sample : sample_surface(mesh, static_cast<int>(count), kSampleSeed)) {
    const OrientedPoint point{sample.point_mm, normal_at(mesh, sample)};
    if (point.normal.norm() > 0.5) points.push_back(point);  // NaN and zero are none
  }
  return points;
}

/// How deep the octree has to be for cells of at most `cell_mm`, within bounds; how wide they then are.
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

o3d::PointCloud to_cloud(const std::vector<OrientedPoint>& points) {
  o3d::PointCloud cloud;
  for (const OrientedPoint& p : points) {
    cloud.points_.push_back(p.point_mm);
    cloud.normals_.push_back(p.normal);
  }
  return cloud;
}

/// One thread: with more, Open3D's sums and with them the bytes depend on how the threads share the work.
Mesh reconstruct(const std::vector<OrientedPoint>& points, int depth) {
  const auto [found, density] = o3d::TriangleMesh::CreateFromPointCloudPoisson(
      to_cloud(points), static_cast<std::size_t>(depth), 0.0F, kCubeScale, false, 1);
  Mesh mesh;
  for (const Eigen::Vector3d& v : found->vertices_) mesh.vertices_mm.push_back(v.cast<float>());
  mesh.triangles = found->triangles_;
  return mesh;
}

bool is_closed(const Mesh& mesh) {
  o3d::TriangleMesh edges;
  for (const Eigen::Vector3f& v : mesh.vertices_mm) edges.vertices_.push_back(v.cast<double>());
  edges.triangles_ = mesh.triangles;
  constexpr bool kMayHaveBorders = false;
  return !mesh.triangles.empty() && edges.IsEdgeManifold(kMayHaveBorders);
}

/// Which vertices are near the source, and its triangle there.
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

/// Without the pieces that nothing touched: where points contradict each other, bubbles arise.
Mesh touched_pieces(const Mesh& mesh, const TriangleScene& source, double reach_mm) {
  const MeshPieces pieces = find_pieces(mesh);
  const std::vector<char> touched = touched_triangles(mesh, closest_to(source, mesh), reach_mm);
  std::vector<char> piece_touched(pieces.area_mm2.size(), 0), chosen(touched.size(), 0);
  const auto piece_of = [&](std::size_t i) { return static_cast<std::size_t>(pieces.of_triangle[i]); };
  for (std::size_t i = 0; i < touched.size(); ++i)
    if (touched[i] != 0) piece_touched[piece_of(i)] = 1;
  for (std::size_t i = 0; i < touched.size(); ++i) chosen[i] = piece_touched[piece_of(i)];
  return triangles_where(mesh, chosen);
}

/// The convex hull of the points and of the points moved inward by `thickness_mm`, facing outward.
Mesh thick_hull(const std::vector<OrientedPoint>& points, double thickness_mm) {
  o3d::PointCloud cloud = to_cloud(points);
  for (const OrientedPoint& p : points) cloud.points_.push_back(p.point_mm - thickness_mm * p.normal);
  const auto hull = std::get<0>(cloud.ComputeConvexHull());
  const Eigen::Vector3d inside = hull->GetCenter();
  Mesh mesh;
  for (const Eigen::Vector3d& v : hull->vertices_) mesh.vertices_mm.push_back(v.cast<float>());
  for (Eigen::Vector3i t : hull->triangles_) {  // Qhull turns them either way
    if (area_normal(mesh, t).dot(corner_mm(mesh, t, 0) - inside) < 0) std::swap(t[1], t[2]);
    mesh.triangles.push_back(t);
  }
  return mesh;
}

/// The surface that the point of the hull sees when it looks inward faces it: then it is the object's side
/// there, and the hull is not.
bool is_behind_surface(const OrientedPoint& p, const TriangleScene& surface, double length_mm) {
  const std::vector<RayHit> hits = surface.cast_all(p.point_mm, -p.normal, length_mm);
  const auto first = std::min_element(hits.begin(), hits.end(), [](const RayHit& a, const RayHit& b) {
    return std::pair(a.distance_mm, a.triangle) < std::pair(b.distance_mm, b.triangle);
  });
  return first != hits.end() && surface.triangle_normal(first->triangle).dot(p.normal) > 0.0;
}

/// The points of `open`, and of the convex hull where `open` does not face outward.
std::vector<OrientedPoint> with_hull(const Mesh& open, double cell_mm) {
  std::vector<OrientedPoint> points = sampled(open, cell_mm);
  const Eigen::Vector3d extent = extent_mm(points);
  const std::vector<OrientedPoint> hull =
      sampled(thick_hull(points, kBackShare * extent.maxCoeff()), cell_mm);
  const TriangleScene surface(open);
  const double length_mm = 2.0 * extent.norm();
  std::vector<char> behind(hull.size(), 0);
  parallel_for_ranges(hull.size(), 1024, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const OrientedPoint outside{hull[i].point_mm + cell_mm * hull[i].normal, hull[i].normal};
      behind[i] = is_behind_surface(outside, surface, length_mm);
    }
  });
  for (std::size_t i = 0; i < hull.size(); ++i)
    if (behind[i] == 0) points.push_back(hull[i]);
  return points;
}

void add_normals(Mesh& mesh) {
  mesh.normals.assign(mesh.vertices_mm.size(), Eigen::Vector3f::Zero());
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (const int corner : t)
      mesh.normals[static_cast<std::size_t>(corner)] += area_normal(mesh, t).cast<float>();
  for (Eigen::Vector3f& normal : mesh.normals) normal.normalize();
}

/// The mean of the nearest triangle's corners, 0 where nothing was touched.
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
  if (is_closed(smooth)) return touched_pieces(smooth, source, reach_mm);
  progress.begin("closing the body", std::nullopt);
  const std::vector<OrientedPoint> points = with_hull(trimmed(smooth, source, reach_mm), octree.cell_mm);
  const Octree larger = octree_of(extent_mm(points).maxCoeff(), octree.cell_mm);
  Mesh body = touched_pieces(reconstruct(points, larger.depth), source, reach_mm);
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
    for (int k = 0; k < 3; ++k) box.extend(corner_mm(touched, t, k));
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
