// Embree 3 and 4 behind one API. The only Embree include.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace kiln::embree {

#if RTC_VERSION_MAJOR >= 4
using Context = RTCRayQueryContext;
inline void init(Context& context) {
  rtcInitRayQueryContext(&context);
}
inline void intersect(RTCScene scene, Context& context, RTCRayHit& rayhit) {
  RTCIntersectArguments args;
  rtcInitIntersectArguments(&args);
  args.context = &context;
  rtcIntersect1(scene, &rayhit, &args);
}
inline void occluded(RTCScene scene, Context& context, RTCRay& ray) {
  RTCOccludedArguments args;
  rtcInitOccludedArguments(&args);
  args.context = &context;
  rtcOccluded1(scene, &ray, &args);
}
// Embree 4 has no streams.
inline void occluded(RTCScene scene, Context& context, RTCRay* rays, unsigned count) {
  for (unsigned i = 0; i < count; ++i) occluded(scene, context, rays[i]);
}
#else
using Context = RTCIntersectContext;
inline void init(Context& context) {
  rtcInitIntersectContext(&context);
}
inline void intersect(RTCScene scene, Context& context, RTCRayHit& rayhit) {
  rtcIntersect1(scene, &context, &rayhit);
}
inline void occluded(RTCScene scene, Context& context, RTCRay& ray) {
  rtcOccluded1(scene, &context, &ray);
}
inline void occluded(RTCScene scene, Context& context, RTCRay* rays, unsigned count) {
  rtcOccluded1M(scene, &context, rays, count, sizeof(RTCRay));
}
#endif

}  // namespace kiln::embree
