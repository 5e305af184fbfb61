#pragma once

#include <Eigen/Core>
#include <memory>
#include <new>

#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh.hpp"

/// Embree 3 (Debian 12) or Embree 4 (Debian 13, Ubuntu 24.04), whose calls for rays differ. GELSLAM_EMBREE is
/// its major version; the rest of Embree's interface that is used here is the same in both.
#if GELSLAM_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

namespace gelslam::embree {

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

/// The triangles of a mesh, whose indices are within range, for searches. Throws Error where Embree does not
/// start, or cannot build the scene.
struct MeshScene {
  MeshScene() = default;
  explicit MeshScene(const Mesh& mesh) : device(rtcNewDevice(nullptr)) {
    if (!device) throw Error("Embree cannot be started on this machine");
    scene.reset(rtcNewScene(device.get()));
    RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices_mm.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (!vertices || !indices) throw std::bad_alloc();
    for (const Eigen::Vector3f& vertex : mesh.vertices_mm)
      for (const float coordinate_mm : vertex) *vertices++ = coordinate_mm;
    for (const Eigen::Vector3i& triangle : mesh.triangles)
      for (const int corner : triangle) *indices++ = static_cast<unsigned>(corner);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene.get());
    if (rtcGetDeviceError(device.get()) != RTC_ERROR_NONE)
      throw Error("Embree cannot build the hierarchy of a mesh");
  }

  std::unique_ptr<RTCDeviceTy, Release> device;
  std::unique_ptr<RTCSceneTy, Release> scene;
};

/// The nearest hit along a ray; its geometry is RTC_INVALID_GEOMETRY_ID where there is none.
inline RTCRayHit first_hit(const MeshScene& triangles, const Eigen::Vector3f& origin,
                           const Eigen::Vector3f& direction, float length) {
  RTCRayHit ray{};
  ray.ray.org_x = origin.x(), ray.ray.org_y = origin.y(), ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x(), ray.ray.dir_y = direction.y(), ray.ray.dir_z = direction.z();
  ray.ray.tfar = length;
  ray.ray.mask = ~0U;  // with any other mask every ray misses
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if GELSLAM_EMBREE == 3
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(triangles.scene.get(), &context, &ray);
#else
  rtcIntersect1(triangles.scene.get(), &ray);
#endif
  return ray;
}

}  // namespace gelslam::embree
