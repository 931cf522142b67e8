// SPDX-License-Identifier: Apache-2.0
// Embree 3 and 4 behind one spelling: where their ray query calls differ.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace hw {

#if RTC_VERSION_MAJOR >= 4
class EmbreeQuery {
 public:
  explicit EmbreeQuery(bool coherent) {
    rtcInitIntersectArguments(&intersect_);
    rtcInitOccludedArguments(&occluded_);
    intersect_.flags = occluded_.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  }
  void intersect1(RTCScene scene, RTCRayHit* rayhit) { rtcIntersect1(scene, rayhit, &intersect_); }
  void occluded1(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, ray, &occluded_); }

 private:
  RTCIntersectArguments intersect_;
  RTCOccludedArguments occluded_;
};
#else
class EmbreeQuery {
 public:
  explicit EmbreeQuery(bool coherent) {
    rtcInitIntersectContext(&context_);
    context_.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  void intersect1(RTCScene scene, RTCRayHit* rayhit) { rtcIntersect1(scene, &context_, rayhit); }
  void occluded1(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, &context_, ray); }

 private:
  RTCIntersectContext context_;
};
#endif

}  // namespace hw
