// SPDX-License-Identifier: Apache-2.0
// Ray against a lamp's shape, in C++ (Embree) and GLSL (ray query). Sphere: E. Haines, J. Günther, T. Akenine-Möller,
// "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019, which holds for distant small spheres.
#ifndef HW_LAMP_INTERSECT_H
#define HW_LAMP_INTERSECT_H
#include "../shared/lights.h"
#include "../shared/portable.h"
HW_NAMESPACE_BEGIN

// World space, metres. The nearest t with tmin < t < tmax where the ray meets the lamp: a sphere from outside or
// inside, a rectangle or ellipse on the side that emits. Returns false and leaves `t` at tmax when there is none.
HW_FN bool lamp_intersect(LampShape lamp, vec3 origin, vec3 direction, float tmin, float tmax, HW_OUT(float) t) {
  t = tmax;
  vec3 to_center = lamp.center - origin;
  if (lamp.shape == HW_LAMP_SHAPE_SPHERE) {
    float a = dot(direction, direction);
    float b = dot(to_center, direction);
    // The centre's offset from the ray's line, computed before squaring: no large numbers cancel.
    vec3 offset = to_center - direction * (b / a);
    float discriminant = lamp.radius * lamp.radius - dot(offset, offset);
    if (!(discriminant >= 0.0f)) return false;
    float root = sqrt(a * discriminant);
    float q = b >= 0.0f ? b + root : b - root;
    float c = dot(to_center, to_center) - lamp.radius * lamp.radius;
    float other = q != 0.0f ? c / q : 0.0f;
    float near = min(other, q / a);
    float far = max(other, q / a);
    float best = near > tmin ? near : far;
    if (!(best > tmin && best < tmax)) return false;
    t = best;
    return true;
  }
  if (lamp.shape == HW_LAMP_SHAPE_NONE) return false;
  if (lamp.shape == HW_LAMP_SHAPE_FACING_DISK) {
    // The disk lies across the line from the ray's origin to the centre.
    float along = dot(to_center, direction);
    float distance2 = dot(to_center, to_center);
    if (!(along > 0.0f)) return false;
    float plane = distance2 / along;
    vec3 p = direction * plane - to_center;
    if (!(plane > tmin && plane < tmax) || dot(p, p) > lamp.radius * lamp.radius) return false;
    t = plane;
    return true;
  }
  // The axes need not be at right angles (sheared lamps): solve for the coordinates in their own basis.
  vec3 normal = cross(lamp.axis_x, lamp.axis_y);
  float normal2 = dot(normal, normal);
  float facing = dot(direction, normal);
  if (!(facing > 0.0f && normal2 > 0.0f)) return false;
  float plane = dot(to_center, normal) / facing;
  if (!(plane > tmin && plane < tmax)) return false;
  vec3 p = direction * plane - to_center;
  float u = dot(cross(p, lamp.axis_y), normal) / normal2;
  float v = dot(cross(lamp.axis_x, p), normal) / normal2;
  bool inside = lamp.shape == HW_LAMP_SHAPE_ELLIPSE ? u * u + v * v <= 1.0f : abs(u) <= 1.0f && abs(v) <= 1.0f;
  if (!inside) return false;
  t = plane;
  return true;
}

// Half the size of the lamp's axis-aligned bounding box about its centre; all 0 for a lamp that is nothing.
HW_FN vec3 lamp_half_extent(LampShape lamp) {
  if (lamp.shape == HW_LAMP_SHAPE_NONE) return vec3(0.0f, 0.0f, 0.0f);
  bool round = lamp.shape == HW_LAMP_SHAPE_SPHERE || lamp.shape == HW_LAMP_SHAPE_FACING_DISK;
  vec3 half_size = round ? vec3(lamp.radius, lamp.radius, lamp.radius) : abs(lamp.axis_x) + abs(lamp.axis_y);
  // Rounding of the traversal's slab test at the box's own distance from the origin must not lose a flat lamp.
  float largest = max(max(abs(lamp.center.x), abs(lamp.center.y)), max(abs(lamp.center.z), 1e-3f));
  float padding = 1e-6f * (largest + max(half_size.x, max(half_size.y, half_size.z)));
  return half_size + vec3(padding, padding, padding);
}

HW_NAMESPACE_END
#endif
