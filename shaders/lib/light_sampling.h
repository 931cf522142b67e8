// SPDX-License-Identifier: Apache-2.0
// Sampling of one light, its pdf, and what a ray that finds it sees. Choosing among lights is the caller's; the world
// has its own functions in world_sampling.h. Units and conventions are those of Cycles 5.0.
#ifndef HW_LIGHT_SAMPLING_H
#define HW_LIGHT_SAMPLING_H
#include "lamp_area.h"
#include "lamp_sphere.h"
#include "lamp_sun.h"
#include "triangle_light.h"
HW_NAMESPACE_BEGIN

// Samples a direction from P towards `light` (not the world). False: this sample brings no light; it counts as zero.
// `u3.z` is spare. `maps`: Root::emission_maps.
HW_FN bool light_sample(LightRecord light, uint64_t maps, vec3 P, vec3 u3, HW_OUT(LightSample) s) {
  vec2 u = vec2(u3.x, u3.y);
  if (HW_LIT_BY(HW_KIND_TRIANGLE) && light.type == HW_LIGHT_TRIANGLE) {
    return triangle_light_sample(light, maps, P, u, s);
  }
  if (HW_LIT_BY(HW_KIND_AREA) && light.type == HW_LIGHT_AREA) {
    return lamp_area_sample(light, P, u, s);
  }
  if (HW_LIT_BY(HW_KIND_SUN) && light.type == HW_LIGHT_SUN) {
    return lamp_sun_sample(light, u, s);
  }
  if (HW_LIT_BY(HW_KIND_POINT) && light.type <= HW_LIGHT_SPOT) {
    return lamp_sphere_sample(light, P, u, s);
  }
  s = light_sample_none();
  return false;
}

// Solid-angle pdf with which light_sample(light, maps, P) makes the direction wi, which meets the light at distance t,
// a triangle in the point with barycentrics uv. 0 where it never does (deltas, sides that are not sampled, the world).
HW_FN float light_pdf(LightRecord light, uint64_t maps, vec3 P, vec3 wi, float t, vec2 uv) {
  if (HW_LIT_BY(HW_KIND_TRIANGLE) && light.type == HW_LIGHT_TRIANGLE) {
    return triangle_light_pdf(light, maps, P, wi, t, uv);
  }
  if (HW_LIT_BY(HW_KIND_AREA) && light.type == HW_LIGHT_AREA) {
    return lamp_area_pdf(light, P, wi, t);
  }
  if (HW_LIT_BY(HW_KIND_SUN) && light.type == HW_LIGHT_SUN) {
    return lamp_sun_pdf(light, wi);
  }
  return HW_LIT_BY(HW_KIND_POINT) && light.type <= HW_LIGHT_SPOT ? lamp_sphere_pdf(light, P) : 0.0f;
}

// Radiance towards P of a lamp (point, spot, area) that a ray from P along wi hits at distance t. `pdf`: as light_pdf.
// `visible`: false when nothing is seen (back of an area lamp, outside the cone or the spread). The caller checks ray
// visibility in light.flags, and lets the ray go on behind the lamp: lamps hide nothing.
HW_FN vec3 lamp_emission(LightRecord light, vec3 P, vec3 wi, float t, HW_OUT(float) pdf, HW_OUT(bool) visible) {
  vec3 radiance = vec3(0.0f);
  pdf = 0.0f;
  if (HW_LIT_BY(HW_KIND_AREA) && light.type == HW_LIGHT_AREA) {
    float cosine = dot(wi, light.axis_z);
    radiance = cosine > 0.0f ? light.emission * lamp_area_spread(light, cosine) : vec3(0.0f);
    pdf = lamp_area_pdf(light, P, wi, t);
  } else if (HW_LIT_BY(HW_KIND_POINT)) {
    vec3 to_center = light.position - P;
    radiance = lamp_sphere_radiance(light, wi, dot(to_center, to_center));
    pdf = lamp_sphere_pdf(light, P);
  }
  visible = radiance.x + radiance.y + radiance.z > 0.0f;
  return radiance;
}

HW_NAMESPACE_END
#endif
