// SPDX-License-Identifier: Apache-2.0
// Sun lamps: a uniform disk of directions about +axis_z (towards the sun), as in Cycles.
#ifndef HW_LAMP_SUN_H
#define HW_LAMP_SUN_H
#include "light_sample.h"
HW_NAMESPACE_BEGIN

HW_FN bool lamp_sun_sample(LightRecord light, vec2 u, HW_OUT(LightSample) s) {
  s = light_sample_none();
  bool delta = light.size_x <= 0.0f;
  float cap;
  vec3 wi = warp_cone(light.axis_z, delta ? 0.0f : light.size_y, u, cap);
  s.wi = delta ? light.axis_z : wi;
  s.distance = HW_INFINITY;
  s.pdf = delta ? 1.0f : 0.5f * HW_INV_PI / light.size_y;
  s.radiance = light.emission;
  s.normal = -s.wi;
  s.flags = delta ? HW_LIGHT_SAMPLE_DELTA : 0u;
  return true;
}

// Solid-angle pdf of lamp_sun_sample; 0 off the disk and for a sun of angle 0.
HW_FN float lamp_sun_pdf(LightRecord light, vec3 wi) {
  bool inside = light.size_x > 0.0f && warp_cap_height(wi, light.axis_z) <= light.size_y;
  return inside ? 0.5f * HW_INV_PI / light.size_y : 0.0f;
}

// Radiance of one sun along a ray that left the scene. Every sun is seen: they add up, with the world behind them.
// `pdf`: as lamp_sun_pdf. The caller checks ray visibility in light.flags.
HW_FN vec3 sun_emission(LightRecord light, vec3 wi, HW_OUT(float) pdf) {
  pdf = lamp_sun_pdf(light, wi);
  return pdf > 0.0f ? light.emission : vec3(0.0f);
}

HW_NAMESPACE_END
#endif
