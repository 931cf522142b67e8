// SPDX-License-Identifier: Apache-2.0
// The ray that asks whether a surface sees a point of a light.
#ifndef HW_SHADOW_RAY_GLSL
#define HW_SHADOW_RAY_GLSL
#include "wave.glsl"

// Where a shadow ray starts: off the surface towards the light; on smooth meshes lifted off the facets where the light
// grazes them (Hanika 2021, with Cycles' cut-off).
vec3 shadow_origin(SurfacePoint point, vec3 wi) {
  float side = dot(point.normal, wi);
  vec3 p = point.position;
  float cutoff = point.terminator_cutoff;
  float amount = side > 0.0 && cutoff > 0.0 && side < cutoff ? clamp(1.0 - side / cutoff, 0.0, 1.0) : 0.0;
  p += point.terminator_offset * amount;
  return offset_origin(p, side < 0.0 ? -point.normal : point.normal);
}

// From the surface along `wi` to just before a light's point at `distance` (HW_INFINITY: a direction), whose surface has
// the unit normal `normal` there.
Ray shadow_ray(SurfacePoint point, vec3 wi, float distance, vec3 normal) {
  Ray ray;
  ray.origin = shadow_origin(point, wi);
  ray.direction = wi;
  ray.tmin = 0.0;
  ray.tmax = HW_INFINITY;
  ray.mask = HW_MASK_SHADOW_OPAQUE;
  ray.flags = 0u;
  if (distance < HW_INFINITY) {
    // End just before the light's own surface, seen from where the ray really starts.
    vec3 end = offset_origin(point.position + wi * distance, normal);
    vec3 along = end - ray.origin;
    float length2 = dot(along, along);
    float inverse = inversesqrt(max(length2, 1e-30));
    ray.direction = along * inverse;
    ray.tmax = length2 * inverse;
  }
  return ray;
}
#endif
