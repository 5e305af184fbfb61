#include "gelslam/evaluation/triangle_scene.hpp"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <utility>

#include "gelslam/core/error.hpp"
#include "parallel.hpp"
#include "triangle_distance.hpp"

namespace gelslam {
namespace {

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct SceneRelease {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DevicePointer = std::unique_ptr<RTCDeviceTy, DeviceRelease>;
using ScenePointer = std::unique_ptr<RTCSceneTy, SceneRelease>;

void check(const Mesh& mesh) {
  if (mesh.triangles.empty()) throw Error("the mesh has no triangles: nothing to measure");
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) {
    if (!vertex.allFinite()) throw Error("the mesh has a vertex that is not finite");
  }
  const auto count = static_cast<std::int64_t>(mesh.vertices_mm.size());
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= count) {
      throw Error("a triangle of the mesh names a vertex that does not exist");
    }
  }
}

ScenePointer build_scene(RTCDevice device, const Mesh& mesh) {
  ScenePointer scene(rtcNewScene(device));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices_mm.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  if (!vertices || !indices) throw std::bad_alloc();
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) vertices = std::copy_n(vertex.data(), 3, vertices);
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    for (const int corner : triangle) *indices++ = static_cast<unsigned>(corner);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  rtcCommitScene(scene.get());
  return scene;
}

struct ClosestSearch {
  const Mesh& mesh;
  Eigen::Vector3d point;
  ClosestPoint best;
};

bool visit_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<ClosestSearch*>(arguments->userPtr);
  const int index = static_cast<int>(arguments->primID);
  const Eigen::Vector3i& corners = search.mesh.triangles[arguments->primID];
  const auto corner = [&](int k) -> Eigen::Vector3d {
    return search.mesh.vertices_mm[static_cast<std::size_t>(corners[k])].cast<double>();
  };
  const Eigen::Vector3d candidate =
      evaluation::detail::closest_on_triangle(search.point, corner(0), corner(1), corner(2));
  const double distance = (candidate - search.point).norm();
  const bool nearer = distance < search.best.distance_mm ||
                      (distance == search.best.distance_mm && index < search.best.triangle);
  if (!nearer) return false;
  search.best = {candidate, distance, index};
  // A little wider than the best, so that ties and single-precision bounds never depend on the order of
  // traversal.
  const double reach = 1.00001 * distance + 1e-4;
  if (reach >= static_cast<double>(arguments->query->radius)) return false;
  arguments->query->radius = static_cast<float>(reach);
  return true;
}

RTCRayHit make_ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length) {
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(origin.x());
  ray.ray.org_y = static_cast<float>(origin.y());
  ray.ray.org_z = static_cast<float>(origin.z());
  ray.ray.dir_x = static_cast<float>(direction.x());
  ray.ray.dir_y = static_cast<float>(direction.y());
  ray.ray.dir_z = static_cast<float>(direction.z());
  ray.ray.tnear = 0.0F;
  ray.ray.tfar = static_cast<float>(length);
  ray.ray.mask = ~0U;  // with any other mask every ray misses
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return ray;
}

RayHit to_hit(float distance, unsigned triangle, float u, float v) {
  return {static_cast<double>(distance), static_cast<int>(triangle), static_cast<double>(u),
          static_cast<double>(v)};
}

/// Embree's filter gets the context by pointer: the hits are kept right behind it.
struct CollectingContext {
  RTCIntersectContext context;
  std::vector<RayHit>* hits;
};

void collect_and_go_on(const RTCFilterFunctionNArguments* arguments) {
  auto* collecting = reinterpret_cast<CollectingContext*>(arguments->context);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] != -1) continue;
    collecting->hits->push_back(
        to_hit(RTCRayN_tfar(arguments->ray, arguments->N, i), RTCHitN_primID(arguments->hit, arguments->N, i),
               RTCHitN_u(arguments->hit, arguments->N, i), RTCHitN_v(arguments->hit, arguments->N, i)));
    arguments->valid[i] = 0;
  }
}

}  // namespace

struct TriangleScene::Impl {
  Mesh mesh;
  DevicePointer device;
  ScenePointer scene;
};

TriangleScene::TriangleScene(Mesh mesh) : impl_(std::make_unique<Impl>()) {
  check(mesh);
  impl_->mesh = std::move(mesh);
  impl_->device.reset(rtcNewDevice(nullptr));
  if (!impl_->device) throw std::runtime_error("Embree cannot be started on this machine");
  impl_->scene = build_scene(impl_->device.get(), impl_->mesh);
  if (const RTCError code = rtcGetDeviceError(impl_->device.get()); code != RTC_ERROR_NONE) {
    throw std::runtime_error("Embree could not build the mesh's hierarchy, code " + std::to_string(code));
  }
}

TriangleScene::~TriangleScene() = default;
TriangleScene::TriangleScene(TriangleScene&&) noexcept = default;
TriangleScene& TriangleScene::operator=(TriangleScene&&) noexcept = default;

ClosestPoint TriangleScene::closest(const Eigen::Vector3d& point_mm) const {
  ClosestSearch search{impl_->mesh, point_mm, {}};
  search.best.distance_mm = std::numeric_limits<double>::infinity();
  RTCPointQuery query{};
  query.x = static_cast<float>(point_mm.x());
  query.y = static_cast<float>(point_mm.y());
  query.z = static_cast<float>(point_mm.z());
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(impl_->scene.get(), &query, &context, &visit_triangle, &search);
  return search.best;
}

std::vector<ClosestPoint> TriangleScene::closest(const std::vector<Eigen::Vector3d>& points_mm) const {
  std::vector<ClosestPoint> result(points_mm.size());
  evaluation::detail::parallel_ranges(points_mm.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = closest(points_mm[i]);
  });
  return result;
}

std::optional<RayHit> TriangleScene::cast(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction,
                                          double length_mm) const {
  RTCRayHit ray = make_ray(origin_mm, direction, length_mm);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->scene.get(), &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return to_hit(ray.ray.tfar, ray.hit.primID, ray.hit.u, ray.hit.v);
}

std::vector<RayHit> TriangleScene::cast_all(const Eigen::Vector3d& origin_mm,
                                            const Eigen::Vector3d& direction, double length_mm) const {
  std::vector<RayHit> hits;
  RTCRayHit ray = make_ray(origin_mm, direction, length_mm);
  CollectingContext collecting{};
  rtcInitIntersectContext(&collecting.context);
  collecting.context.filter = &collect_and_go_on;
  collecting.hits = &hits;
  rtcIntersect1(impl_->scene.get(), &collecting.context, &ray);
  return hits;
}

bool TriangleScene::is_occluded(const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& direction,
                                double length_mm) const {
  RTCRay ray = make_ray(origin_mm, direction, length_mm).ray;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(impl_->scene.get(), &context, &ray);
  return ray.tfar < 0.0F;
}

const Mesh& TriangleScene::mesh() const { return impl_->mesh; }

Eigen::Vector3d TriangleScene::triangle_normal(int triangle) const {
  const Eigen::Vector3i& corners = impl_->mesh.triangles.at(static_cast<std::size_t>(triangle));
  const auto corner = [&](int k) -> Eigen::Vector3d {
    return impl_->mesh.vertices_mm[static_cast<std::size_t>(corners[k])].cast<double>();
  };
  const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  const double length = normal.norm();
  return length > 0.0 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::Zero();
}

}  // namespace gelslam
