#pragma once

/// Rays by Embree 3 (Debian 12) or Embree 4 (Debian 13, Ubuntu 24.04), whose calls differ. GELSLAM_EMBREE is
/// its major version; the rest of Embree's interface that is used here is the same in both.

#if GELSLAM_EMBREE == 3
#include <embree3/rtcore.h>

namespace gelslam::embree {

using RayContext = RTCIntersectContext;
inline constexpr RTCSceneFlags kFilteredByRay = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

/// The nearest hit of `ray`. `filter`, in scenes with kFilteredByRay, sees every hit and finds `context` in
/// its arguments.
inline void intersect(RTCScene scene, RTCRayHit& ray, RayContext& context,
                      RTCFilterFunctionN filter = nullptr) {
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcIntersect1(scene, &context, &ray);
}

}  // namespace gelslam::embree

#else
#include <embree4/rtcore.h>

namespace gelslam::embree {

using RayContext = RTCRayQueryContext;
inline constexpr RTCSceneFlags kFilteredByRay = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

inline void intersect(RTCScene scene, RTCRayHit& ray, RayContext& context,
                      RTCFilterFunctionN filter = nullptr) {
  rtcInitRayQueryContext(&context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  arguments.filter = filter;
  if (filter) arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcIntersect1(scene, &ray, &arguments);
}

}  // namespace gelslam::embree

#endif
