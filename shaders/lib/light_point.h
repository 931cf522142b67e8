// SPDX-License-Identifier: Apache-2.0
// A point on a light as a sample that any surface can use: the light's index and two numbers say where, whatever the
// receiver (ALGORITHMS: identity shift). Its measure is the light's own, normalised to one: area over the whole area
// for anything with a surface, solid angle over the whole solid angle for suns and the world, one for true points. So a
// sample stays valid, with Jacobian one, when its light moves, turns, grows or deforms.
//
// light_point() gives, at a receiver, the direction, the radiance, and `density` = solid angle seen per unit of that
// measure: radiance · density is what the integrand has besides BSDF and visibility. For a true point radiance ·
// density is the irradiance at normal incidence.
#ifndef HW_LIGHT_POINT_H
#define HW_LIGHT_POINT_H
#include "light_sampling.h"
#include "world_sampling.h"
HW_NAMESPACE_BEGIN

struct LightPoint {
  vec3 wi;         // unit, from the receiver
  float distance;  // HW_INFINITY for suns and the world
  vec3 radiance;   // towards the receiver, where the record has it
  float density;   // solid angle per unit measure [sr]; 1 for deltas; 0: nothing arrives
  vec3 normal;     // of the light at the point, on the side that emits
  bool delta;      // no BSDF ray finds it
};

// Triangle barycentrics, place on a lamp, direction of the world, as two numbers in [0, 1].
HW_FN vec3 light_world_direction(vec2 uv) {
  float z = 2.0f * uv.y - 1.0f;
  float r = sqrt(max(0.0f, 1.0f - z * z));
  float phi = HW_PI * (2.0f * uv.x - 1.0f);
  return vec3(r * cos(phi), r * sin(phi), z);
}
HW_FN vec2 light_world_uv(vec3 wi) {
  float phi = wi.x * wi.x + wi.y * wi.y > 0.0f ? atan(wi.y, wi.x) : 0.0f;
  return vec2(0.5f + phi * 0.5f * HW_INV_PI, 0.5f + 0.5f * wi.z);
}

// Uniform on the unit disk and back: (radius squared, turn).
HW_FN vec2 light_disk(vec2 uv) {
  float r = sqrt(uv.x);
  return vec2(r * cos(2.0f * HW_PI * uv.y), r * sin(2.0f * HW_PI * uv.y));
}
HW_FN float light_turn(float x, float y) {
  float turn = x * x + y * y > 0.0f ? atan(y, x) * 0.5f * HW_INV_PI : 0.0f;
  return turn < 0.0f ? turn + 1.0f : turn;
}

// Evaluates the point `uv` of `light` for a receiver at P. The radiance of the world and of programs is for the caller
// to bring in.
HW_FN LightPoint light_point(LightRecord light, vec2 uv, vec3 P) {
  LightPoint p;
  p.radiance = light.emission;
  p.delta = false;
  p.distance = HW_INFINITY;
  p.density = 0.0f;
  p.normal = vec3(0.0f, 0.0f, 1.0f);
  p.wi = p.normal;
  vec3 to_center = light.position - P;
  if (HW_LIT_BY(HW_KIND_TRIANGLE) && light.type == HW_LIGHT_TRIANGLE) {
    vec3 d = to_center + light.axis_x * uv.x + light.axis_y * uv.y;
    float t2 = max(dot(d, d), 1e-30f);
    float inv_t = inversesqrt(t2);
    p.wi = d * inv_t;
    p.distance = t2 * inv_t;
    float cosine = -dot(p.wi, light.axis_z);
    bool two_sided = (light.flags & HW_LIGHT_TWO_SIDED) != 0u;
    p.normal = cosine < 0.0f ? -light.axis_z : light.axis_z;
    cosine = two_sided ? abs(cosine) : cosine;
    p.density = max(cosine, 0.0f) * light.area * inv_t * inv_t;
    return p;
  }
  if (HW_LIT_BY(HW_KIND_WORLD) && light.type == HW_LIGHT_WORLD) {
    p.wi = light_world_direction(uv);
    p.normal = -p.wi;
    p.density = 4.0f * HW_PI;
    return p;
  }
  if (HW_LIT_BY(HW_KIND_SUN) && light.type == HW_LIGHT_SUN) {
    p.delta = light.size_x <= 0.0f;
    vec3 x, y;
    warp_frame(light.axis_z, x, y);
    float height = uv.x * light.size_y;  // 1 - cos of the angle to the axis
    vec2 around = light_disk(vec2(1.0f, uv.y)) * sqrt(max(height * (2.0f - height), 0.0f));
    p.wi = p.delta ? light.axis_z : normalize(x * around.x + y * around.y + light.axis_z * (1.0f - height));
    p.normal = -p.wi;
    p.density = p.delta ? 1.0f : 2.0f * HW_PI * light.size_y;
    return p;
  }
  if (HW_LIT_BY(HW_KIND_AREA) && light.type == HW_LIGHT_AREA) {
    bool ellipse = lamp_area_is_ellipse(light);
    // A spread of nothing lights along the normal only: the point is the receiver's own foot on the lamp.
    p.delta = lamp_area_limited(light) && light.spread_or_spot <= 0.0f;
    float height = dot(to_center, light.axis_z);
    vec2 foot = -vec2(dot(to_center, light.axis_x), dot(to_center, light.axis_y));
    vec2 at = (uv - vec2(0.5f)) * vec2(light.size_x, light.size_y);
    at = p.delta ? foot : at;
    vec2 e = vec2(foot.x / max(light.size_x, 1e-30f), foot.y / max(light.size_y, 1e-30f));
    bool on_lamp = ellipse ? dot(e, e) <= 0.25f : max(abs(e.x), abs(e.y)) <= 0.5f;
    vec3 d = to_center + light.axis_x * at.x + light.axis_y * at.y;
    float t2 = max(dot(d, d), 1e-30f);
    float inv_t = inversesqrt(t2);
    p.wi = p.delta ? light.axis_z : d * inv_t;
    p.distance = t2 * inv_t;
    p.normal = -light.axis_z;
    float cosine = max(dot(p.wi, light.axis_z), 0.0f);
    float area = light.size_x * light.size_y * (ellipse ? 0.25f * HW_PI : 1.0f);
    p.density = p.delta ? (on_lamp && height > 0.0f ? 1.0f : 0.0f) : cosine * area * inv_t * inv_t;
    p.radiance = light.emission * (cosine > 0.0f ? lamp_area_spread(light, cosine) : 0.0f);
    return p;
  }
  // Point and spot.
  if (!HW_LIT_BY(HW_KIND_POINT)) return p;
  float d2 = dot(to_center, to_center);
  if (!(d2 > 1e-30f)) return p;
  float radius = light.size_x;
  vec3 axis = to_center * inversesqrt(d2);
  p.delta = radius <= 0.0f;
  bool disk = lamp_sphere_is_disk(light);
  bool inside = !disk && d2 <= radius * radius;
  vec3 tangent, bitangent;
  warp_frame(axis, tangent, bitangent);
  vec2 on_disk = light_disk(uv);
  vec3 on_sphere = warp_sphere(uv);
  vec3 offset = disk ? tangent * on_disk.x + bitangent * on_disk.y : on_sphere;
  vec3 d = to_center + offset * (p.delta ? 0.0f : radius);
  float t2 = max(dot(d, d), 1e-30f);
  float inv_t = inversesqrt(t2);
  p.wi = p.delta ? axis : d * inv_t;
  p.distance = t2 * inv_t;
  p.normal = disk || p.delta ? -axis : on_sphere;
  float cosine = disk ? dot(p.wi, axis) : -dot(p.wi, on_sphere);
  cosine = inside ? abs(cosine) : max(cosine, 0.0f);
  float area = HW_PI * radius * radius * (disk ? 1.0f : 4.0f);
  p.density = p.delta ? 1.0f : cosine * area * inv_t * inv_t;
  p.radiance = lamp_sphere_radiance(light, p.wi, d2) * (p.delta ? 1.0f / d2 : 1.0f);
  return p;
}

// The place of the point that a direction from P found at a distance (LightSample): the inverse of light_point.
HW_FN vec2 light_point_uv(LightRecord light, vec3 P, HW_IN(LightSample) s) {
  if (light.type == HW_LIGHT_TRIANGLE || light.type == HW_LIGHT_AREA) return s.uv;
  vec3 x, y;
  if (HW_LIT_BY(HW_KIND_SUN) && light.type == HW_LIGHT_SUN) {
    warp_frame(light.axis_z, x, y);
    float height = min(warp_cap_height(s.wi, light.axis_z) / max(light.size_y, 1e-30f), 1.0f);
    return vec2(height, light_turn(dot(s.wi, x), dot(s.wi, y)));
  }
  vec3 to_center = light.position - P;
  vec3 offset = s.wi * s.distance - to_center;
  float inverse_r = 1.0f / max(light.size_x, 1e-30f);
  if (lamp_sphere_is_disk(light)) {
    warp_frame(to_center * inversesqrt(max(dot(to_center, to_center), 1e-30f)), x, y);
    return vec2(min(dot(offset, offset) * inverse_r * inverse_r, 1.0f), light_turn(dot(offset, x), dot(offset, y)));
  }
  vec3 n = offset * inverse_r;
  return vec2(clamp(0.5f - 0.5f * n.z, 0.0f, 1.0f), light_turn(n.x, n.y));
}

// Any point of the light, uniformly.
HW_FN vec2 light_point_uniform(LightRecord light, vec2 u) {
  if (light.type == HW_LIGHT_TRIANGLE) return triangle_warp_area(u);
  bool ellipse = light.type == HW_LIGHT_AREA && (light.flags & HW_LIGHT_ELLIPSE) != 0u;
  return ellipse ? warp_disk(u) * 0.5f + vec2(0.5f) : u;
}

// The share of samples to be drawn uniformly over the light where the others are drawn by light_sample. A sample is
// weighed by what other receivers would have made of it, so that each must be able to draw every point of a light, also
// those turned away from it: else what only others see would be lost. 0: light_sample reaches every point from
// anywhere.
HW_FN float light_uniform_share(LightRecord light) {
  bool limited_spot = light.type == HW_LIGHT_SPOT && light.size_x > 0.0f;       // to its cone
  bool limited_area = light.type == HW_LIGHT_AREA && light.spot_smooth > 0.0f;  // to its spread
  bool round = light.type == HW_LIGHT_POINT && !lamp_sphere_is_disk(light) && light.size_x > 0.0f;
  bool one_sided = light.type == HW_LIGHT_TRIANGLE && (light.flags & HW_LIGHT_TWO_SIDED) == 0u;
  bool turned = round || one_sided || light.type == HW_LIGHT_AREA;
  return limited_spot || limited_area ? 1.0f : turned ? 1.0f / 16.0f : 0.0f;
}

// Solid-angle pdf with which `path` would find the point by next-event estimation, once it has chosen the light: what
// MIS against BSDF rays weighs (see shade.comp). `uv`: its place.
HW_FN float light_point_mis_pdf(LightRecord light, uint64_t maps, WorldDistribution world, vec3 P, HW_IN(LightPoint) p,
                                vec2 uv) {
  if (HW_LIT_BY(HW_KIND_WORLD) && light.type == HW_LIGHT_WORLD) return world_pdf(world, p.wi);
  return light_pdf(light, maps, P, p.wi, p.distance, uv);
}

HW_NAMESPACE_END
#endif
