// SPDX-License-Identifier: Apache-2.0
// What sampling a light returns, whatever its kind.
#ifndef HW_LIGHT_SAMPLE_H
#define HW_LIGHT_SAMPLE_H
#include "../shared/light_kinds.h"
#include "warp.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_LIGHT_SAMPLE_DELTA = 1u;  // no BSDF ray can find this light: no MIS

struct LightSample {
  vec3 wi;         // unit, from P towards the light
  float distance;  // from P to the light point [m]; HW_INFINITY for suns. Shadow rays should stop slightly before
  vec3
      radiance;  // towards P: radiance / pdf is the estimator's factor, for deltas too (irradiance at normal incidence)
  float pdf;     // solid angle [1/sr], given this light; 1 for deltas
  vec2 uv;       // triangle: barycentrics as in Hit; area: 0..1 across the lamp; others: 0
  vec3 normal;   // unit normal of the light at the point, on the side that emits towards P
  uint flags;    // HW_LIGHT_SAMPLE_*
};

HW_FN LightSample light_sample_none() {
  LightSample s;
  s.wi = vec3(0.0f, 0.0f, 1.0f);
  s.distance = 0.0f;
  s.radiance = vec3(0.0f);
  s.pdf = 0.0f;
  s.uv = vec2(0.0f);
  s.normal = vec3(0.0f, 0.0f, 1.0f);
  s.flags = 0u;
  return s;
}

HW_NAMESPACE_END
#endif
