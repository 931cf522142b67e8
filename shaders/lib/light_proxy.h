// SPDX-License-Identifier: Apache-2.0
// A light as the target function of reuse sees it (LightProxy, shared/reuse.h): by its middle, with bounds for its
// extent, as light trees do (Conty Estevez and Kulla 2018). It costs a quarter of the light's own record to read.
#ifndef HW_LIGHT_PROXY_H
#define HW_LIGHT_PROXY_H
#include "../shared/reuse.h"
#include "frame.h"
#include "light_sample.h"
HW_NAMESPACE_BEGIN

HW_FN float luminance(vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

// `entry`: the light's in the alias table; `world_radiance`: mean luminance of the world.
HW_FN LightProxy light_proxy(LightRecord light, HW_IN(AliasEntry) entry, float world_radiance, uint world_flags) {
  LightProxy p;
  p.threshold = entry.threshold;
  p.alias = entry.alias;
  p.center = light.position;
  p.radius = 0.0f;
  p.area = 0.0f;
  p.flags = (light.flags & HW_LIGHT_USE_MIS) != 0u ? HW_PROXY_WEIGHED : 0u;
  p.inverse_choice = entry.pdf > 0.0f ? 1.0f / entry.pdf : 0.0f;
  vec3 axis = vec3(0.0f, 0.0f, 1.0f);
  float a = 0.0f;
  float b = 1.0f;
  float radiance = luminance(max(light.emission, vec3(0.0f)));
  if (light.type == HW_LIGHT_TRIANGLE) {
    vec3 to_middle = (light.axis_x + light.axis_y) * (1.0f / 3.0f);
    p.center = light.position + to_middle;
    float farthest = max(dot(to_middle, to_middle), dot(light.axis_x - to_middle, light.axis_x - to_middle));
    p.radius = sqrt(max(farthest, dot(light.axis_y - to_middle, light.axis_y - to_middle)));
    p.area = light.area;
    axis = light.axis_z;
    a = 1.0f;
    b = 0.0f;
    p.flags |= (light.flags & HW_LIGHT_TWO_SIDED) != 0u ? HW_PROXY_TWO_SIDED : 0u;
    p.flags |= light.emission_map << HW_PROXY_MAP_SHIFT;
    // A program's emission may be estimated as black and still shine.
    radiance = (light.flags & HW_LIGHT_SHADER) != 0u && !(radiance > 0.0f) ? 1.0f : radiance;
    p.intensity = radiance * p.area;
  } else if (light.type == HW_LIGHT_AREA) {
    bool ellipse = (light.flags & HW_LIGHT_ELLIPSE) != 0u;
    bool delta = light.spot_smooth > 0.0f && light.spread_or_spot <= 0.0f;
    p.area = light.size_x * light.size_y * (ellipse ? 0.25f * HW_PI : 1.0f);
    p.radius = 0.5f * sqrt(light.size_x * light.size_x + light.size_y * light.size_y);
    axis = -light.axis_z;
    a = 1.0f;
    b = 0.0f;
    if (delta) p.flags &= ~HW_PROXY_WEIGHED;
    p.intensity = radiance * p.area;
  } else if (light.type == HW_LIGHT_SUN) {
    p.center = light.axis_z;
    p.radius = sin(light.size_x);
    p.area = 2.0f * HW_PI * light.size_y;
    p.intensity = radiance * (light.size_x > 0.0f ? p.area : 1.0f);
    p.flags |= HW_PROXY_SUN;
  } else if (light.type == HW_LIGHT_WORLD) {
    p.flags = HW_PROXY_WORLD | ((world_flags & HW_LIGHT_USE_MIS) != 0u ? HW_PROXY_WEIGHED : 0u);
    p.area = 4.0f * HW_PI;
    p.intensity = world_radiance > 0.0f ? world_radiance : 1.0f;
  } else {
    p.radius = light.size_x;
    p.area = HW_PI * light.size_x * light.size_x;
    p.intensity = radiance * (light.size_x > 0.0f ? p.area : 1.0f);
    if (light.type == HW_LIGHT_SPOT) {
      axis = -light.axis_z;
      // The falloff is in the lamp's own space: taken over only where that is neither stretched nor sheared.
      vec3 x = light.axis_x;
      vec3 y = light.axis_y;
      vec3 z = light.axis_z;
      float scale2 = max(dot(z, z), 1e-30f);
      float stretch = max(abs(dot(x, x) - scale2), abs(dot(y, y) - scale2));
      stretch = max(stretch, max(abs(dot(x, y)), max(abs(dot(x, z)), abs(dot(y, z)))));
      float slope = min(light.spot_smooth, 1e3f);
      // Wider by 1.5e-3 of the cosine: what half floats, the packed axis and a stretch let pass may add up to, which
      // at the edge of a sharp cone would be darkness where there is light.
      float edge = light.spread_or_spot - 1.5e-3f;
      a = stretch < 1e-3f * scale2 ? slope : 0.0f;
      b = stretch < 1e-3f * scale2 ? 0.01f - edge * slope : 1.0f;
    }
  }
  if (!(light.size_x > 0.0f) && (light.type <= HW_LIGHT_SUN)) p.flags &= ~HW_PROXY_WEIGHED;
  float length2 = dot(axis, axis);
  p.axis = octahedral_pack(length2 > 0.0f ? axis * inversesqrt(length2) : vec3(0.0f, 0.0f, 1.0f));
  p.emission = packHalf2x16(vec2(a, b));
  return p;
}

HW_NAMESPACE_END
#endif
