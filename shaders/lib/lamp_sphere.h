// SPDX-License-Identifier: Apache-2.0
// Point and spot lamps: a sphere, or with soft falloff (Blender's default) a disk that always faces the receiver.
// Seen from P both fill a circular cone of directions, so both are sampled uniformly in solid angle. A spot whose own
// cone is narrower than that is sampled by its cone instead, as in Cycles.
#ifndef HW_LAMP_SPHERE_H
#define HW_LAMP_SPHERE_H
#include "light_sample.h"
HW_NAMESPACE_BEGIN

// Cycles' spot falloff for the direction `wi` from the receiver to the lamp: a smooth step of the cosine in the lamp's
// own (possibly scaled) space. 1 for point lamps.
HW_FN float lamp_spot_falloff(LightRecord light, vec3 wi) {
  if (!HW_LIT_BY(HW_KIND_SPOT)) return 1.0f;
  float x = dot(light.axis_x, wi);
  float y = dot(light.axis_y, wi);
  float z = dot(light.axis_z, wi);
  float cosine = z * inversesqrt(max(x * x + y * y + z * z, 1e-30f));
  float f = clamp((cosine - light.spread_or_spot) * light.spot_smooth, 0.0f, 1.0f);
  return light.type == HW_LIGHT_SPOT ? f * f * (3.0f - 2.0f * f) : 1.0f;
}

HW_FN bool lamp_sphere_is_disk(LightRecord light) {
  return !HW_LIT_BY(HW_KIND_BALL) || (light.flags & HW_LIGHT_SOFT_FALLOFF) != 0u;
}

// 1 - cos of the half angle the lamp fills at distance sqrt(d2); 2 (all directions) inside a sphere.
HW_FN float lamp_sphere_height(LightRecord light, float d2) {
  float r2 = light.size_x * light.size_x;
  bool disk = lamp_sphere_is_disk(light);
  float sin2 = r2 / max(disk ? d2 + r2 : d2, 1e-36f);
  return !disk && d2 <= r2 ? 2.0f : warp_one_minus_cos(min(sin2, 1.0f));
}

// Height of the cone that is sampled, and whether it is the spot's own cone about its axis.
HW_FN float lamp_sphere_sampled_height(LightRecord light, float d2, HW_OUT(bool) own_cone) {
  float height = lamp_sphere_height(light, d2);
  own_cone = HW_LIT_BY(HW_KIND_SPOT) && light.type == HW_LIGHT_SPOT && light.size_y < height && height < 2.0f;
  return own_cone ? light.size_y : height;
}

// Distance to the lamp's surface along a direction for which `cap` is 1 - cos of its angle to the lamp's centre, at
// distance sqrt(d2); negative when the lamp is missed.
HW_FN float lamp_sphere_distance(LightRecord light, float d2, float cap) {
  float d = sqrt(d2);
  float cosine = 1.0f - cap;
  float sin2 = cap * (2.0f - cap);
  float r2 = light.size_x * light.size_x;
  float under_root = r2 - d2 * sin2;
  float root = sqrt(max(under_root, 0.0f));
  // Near point from outside written without cancellation; far point from inside.
  float near_t = (d2 - r2) / max(d * cosine + root, 1e-30f);
  float t_sphere = under_root < 0.0f || (d2 > r2 && cosine <= 0.0f) ? -1.0f : (d2 > r2 ? near_t : d * cosine + root);
  // Disk through the centre, normal along to_center.
  float t_disk = d / max(cosine, 1e-8f);
  t_disk = cosine > 1e-8f && t_disk * t_disk * sin2 <= r2 ? t_disk : -1.0f;
  return lamp_sphere_is_disk(light) ? t_disk : t_sphere;
}

// Radiance of the lamp towards a receiver at distance sqrt(d2), along wi. A spot's cone does not limit a receiver
// inside its sphere.
// Departure from Cycles 5.0: there, BSDF rays from inside a spot's sphere that lead away from its centre do not find
// it, though light samples are weighed as if they did. Such a receiver gets all the light here, as Cycles' point lamps
// and its spots without multiple importance sampling give it.
HW_FN vec3 lamp_sphere_radiance(LightRecord light, vec3 wi, float d2) {
  bool inside = !lamp_sphere_is_disk(light) && d2 <= light.size_x * light.size_x;
  return light.emission * (inside ? 1.0f : lamp_spot_falloff(light, wi));
}

// Samples a point or spot lamp from P. False: no light arrives by this sample.
HW_FN bool lamp_sphere_sample(LightRecord light, vec3 P, vec2 u, HW_OUT(LightSample) s) {
  s = light_sample_none();
  vec3 to_center = light.position - P;
  float d2 = dot(to_center, to_center);
  if (!(d2 > 1e-30f)) {
    return false;
  }
  vec3 axis = to_center * inversesqrt(d2);
  bool delta = light.size_x <= 0.0f;
  bool own_cone;
  float height = lamp_sphere_sampled_height(light, d2, own_cone);
  // The spot's axis (where it points) is -column z of its matrix, along the cross product of the inverse's rows.
  vec3 spot_axis = cross(light.axis_x, light.axis_y);
  spot_axis = spot_axis * inversesqrt(max(dot(spot_axis, spot_axis), 1e-36f));
  spot_axis = dot(spot_axis, light.axis_z) < 0.0f ? -spot_axis : spot_axis;
  float cap;
  vec3 wi = warp_cone(own_cone ? spot_axis : axis, delta ? 0.0f : height, u, cap);
  cap = own_cone ? warp_cap_height(wi, axis) : cap;
  float t = delta ? sqrt(d2) : lamp_sphere_distance(light, d2, cap);
  // A direction drawn inside the visible cone hits by construction, up to rounding at the rim.
  t = t < 0.0f && !own_cone ? sqrt(d2) : t;
  s.wi = delta ? axis : wi;
  s.distance = t;
  s.pdf = delta ? 1.0f : 0.5f * HW_INV_PI / max(height, 1e-30f);
  s.radiance = lamp_sphere_radiance(light, s.wi, d2) * (delta ? 1.0f / d2 : 1.0f);
  vec3 outward = s.wi * t - to_center;
  bool round = !delta && !lamp_sphere_is_disk(light);
  s.normal = round ? outward * (1.0f / light.size_x) : (delta ? -s.wi : -axis);
  s.flags = delta ? HW_LIGHT_SAMPLE_DELTA : 0u;
  return t >= 0.0f && s.radiance.x + s.radiance.y + s.radiance.z > 0.0f;
}

// Solid-angle pdf with which lamp_sphere_sample makes a direction from P that hits the lamp, the same for all such
// directions (that a spot's own cone holds); 0 for a true point.
HW_FN float lamp_sphere_pdf(LightRecord light, vec3 P) {
  vec3 to_center = light.position - P;
  float d2 = dot(to_center, to_center);
  bool own_cone;
  float height = lamp_sphere_sampled_height(light, d2, own_cone);
  return light.size_x > 0.0f && d2 > 1e-30f ? 0.5f * HW_INV_PI / max(height, 1e-30f) : 0.0f;
}

HW_NAMESPACE_END
#endif
