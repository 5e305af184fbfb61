#include "gelslam/evaluation/triangle_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/parallel.hpp"
#include "mesh_scene.hpp"

namespace gelslam {
namespace {

/// closest() tests kJudgedPoints of the points. If their searches visit more than kMaxVisits * kJudgedPoints
/// triangles in total (this total is fixed, so the limit per search is higher for fewer points), searches
/// from the triangles' own centers are tested in the same way. Only if these exceed the limit, too, the mesh
/// is refused because too many of its triangles coincide: usual meshes need some dozens of visits. The second
/// test is needed because a point at the same distance from the whole surface, such as the center of a ball,
/// makes a search visit everything in a good mesh, too.
constexpr std::size_t kMaxVisits = 1000;
constexpr std::size_t kJudgedPoints = 512;
constexpr std::size_t kSearchesAtOnce = 1024;

Eigen::Vector3d closest_on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  if (length2 == 0.0) return a;
  return a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab;
}

/// Returns the point of triangle abc nearest to p. Triangles without area are treated as their edges.
Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double normal2 = normal.squaredNorm();
  if (normal2 > 0.0) {
    // For a point within the prism above the triangle, the foot of the perpendicular is the nearest point.
    const bool inside = normal.cross(b - a).dot(p - a) >= 0.0 && normal.cross(c - b).dot(p - b) >= 0.0 &&
                        normal.cross(a - c).dot(p - c) >= 0.0;
    if (inside) return p - (p - a).dot(normal) / normal2 * normal;
  }
  Eigen::Vector3d best = closest_on_segment(p, a, b);
  for (const Eigen::Vector3d& candidate : {closest_on_segment(p, b, c), closest_on_segment(p, c, a)})
    if ((candidate - p).squaredNorm() < (best - p).squaredNorm()) best = candidate;
  return best;
}

struct ClosestSearch {
  const Mesh& mesh;
  Eigen::Vector3d point;
  ClosestPoint best;
  std::size_t visits = 0;  ///< Number of triangles visited.
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<ClosestSearch*>(arguments->userPtr);
  ++search.visits;
  const int index = static_cast<int>(arguments->primID);
  const auto [a, b, c] = corners_mm(search.mesh, search.mesh.triangles[arguments->primID]);
  const Eigen::Vector3d candidate = closest_on_triangle(search.point, a, b, c);
  const double distance = (candidate - search.point).norm();
  const bool nearer = distance < search.best.distance_mm ||
                      (distance == search.best.distance_mm && index < search.best.triangle);
  if (!nearer) return false;
  search.best = {candidate, distance, index};
  // Slightly larger than the best distance, so that ties and single-precision bounds do not depend on the
  // order of traversal.
  const double reach = 1.00001 * distance + 1e-4;
  if (reach >= static_cast<double>(arguments->query->radius)) return false;
  arguments->query->radius = static_cast<float>(reach);
  return true;
}

}  // namespace

struct TriangleScene::Impl {
  Mesh mesh;
  embree::MeshScene triangles;

  /// Returns the triangle nearest to a point, and adds the number of triangles visited to `visits`.
  ClosestPoint closest(const Eigen::Vector3d& point_mm, std::size_t& visits) const {
    ClosestSearch search{mesh, point_mm, {}};
    search.best.distance_mm = std::numeric_limits<double>::infinity();
    RTCPointQuery query{};
    query.x = static_cast<float>(point_mm.x());
    query.y = static_cast<float>(point_mm.y());
    query.z = static_cast<float>(point_mm.z());
    query.radius = std::numeric_limits<float>::infinity();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(triangles.scene.get(), &query, &context, &visit_triangle, &search);
    visits += search.visits;
    return search.best;
  }
};

TriangleScene::TriangleScene(Mesh mesh) : impl_(std::make_unique<Impl>()) {
  check_measurable(mesh);
  impl_->mesh = std::move(mesh);
  impl_->triangles = embree::MeshScene(impl_->mesh);
}

TriangleScene::~TriangleScene() = default;

std::vector<ClosestPoint> TriangleScene::closest(const std::vector<Eigen::Vector3d>& points_mm) const {
  const auto takes_long = [&](std::size_t count, const auto& point) {
    std::size_t visits = 0;
    for (std::size_t i = 0; i < count && visits <= kMaxVisits * kJudgedPoints; i += 1 + count / kJudgedPoints)
      impl_->closest(point(i), visits);
    return visits > kMaxVisits * kJudgedPoints;
  };
  const auto center = [&](std::size_t i) {
    const auto [a, b, c] = corners_mm(mesh(), mesh().triangles[i]);
    return Eigen::Vector3d((a + b + c) / 3);
  };
  if (takes_long(points_mm.size(), [&](std::size_t i) { return points_mm[i]; }) &&
      takes_long(mesh().triangles.size(), center))
    throw Error("the mesh cannot be measured: thousands of its triangles lie at the same place");
  std::vector<ClosestPoint> result(points_mm.size());
  parallel_for_ranges(points_mm.size(), kSearchesAtOnce, 0, [&](std::size_t begin, std::size_t end) {
    std::size_t uncounted = 0;
    for (std::size_t i = begin; i < end; ++i) result[i] = impl_->closest(points_mm[i], uncounted);
  });
  return result;
}

int TriangleScene::first_hit(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction,
                             double length_mm) const {
  const RTCRayHit ray = embree::first_hit(impl_->triangles, origin_mm.cast<float>(), direction.cast<float>(),
                                          static_cast<float>(length_mm));
  return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1 : static_cast<int>(ray.hit.primID);
}

const Mesh& TriangleScene::mesh() const { return impl_->mesh; }

Eigen::Vector3d TriangleScene::triangle_normal(int triangle) const {
  return area_normal(mesh(), mesh().triangles.at(static_cast<std::size_t>(triangle))).normalized();
}

}  // namespace gelslam
