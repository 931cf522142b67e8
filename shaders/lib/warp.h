// SPDX-License-Identifier: Apache-2.0
// Maps from the unit square to shapes and directions, and small geometry shared by the light and camera code.
#ifndef HW_WARP_H
#define HW_WARP_H
#include "../shared/portable.h"
HW_NAMESPACE_BEGIN

// Tangent frame of a unit vector without a branch: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
HW_FN void warp_frame(vec3 n, HW_OUT(vec3) tangent, HW_OUT(vec3) bitangent) {
  float s = n.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (s + n.z);
  float b = n.x * n.y * a;
  tangent = vec3(1.0f + s * n.x * n.x * a, s * b, -s * n.x);
  bitangent = vec3(b, s + n.y * n.y * a, -n.y);
}

// Unit square to unit disk keeping areas and neighbourhoods: Shirley and Chiu 1997.
HW_FN vec2 warp_disk(vec2 u) {
  float a = 2.0f * u.x - 1.0f;
  float b = 2.0f * u.y - 1.0f;
  bool wide = abs(a) > abs(b);
  float r = wide ? a : b;
  float q = wide ? b : a;
  float phi = r == 0.0f ? 0.0f : 0.25f * HW_PI * q / r;
  phi = wide ? phi : 0.5f * HW_PI - phi;
  return vec2(r * cos(phi), r * sin(phi));
}

// 1 - cos of an angle from its squared sine, exact for small angles. Angles in [0, pi/2].
HW_FN float warp_one_minus_cos(float sin2) { return sin2 / (1.0f + sqrt(max(0.0f, 1.0f - sin2))); }

// Uniform direction in the cone about the unit vector `axis` whose half angle has 1 - cos = `height` (0..2).
// `one_minus_cos` returns 1 - cos of the angle between the direction and the axis. The pdf is 1 / (2 pi height).
HW_FN vec3 warp_cone(vec3 axis, float height, vec2 u, HW_OUT(float) one_minus_cos) {
  vec2 d = warp_disk(u);
  float r2 = min(d.x * d.x + d.y * d.y, 1.0f);
  // r2 is uniform in [0, 1], so the height of the cap is too; sin / r has no pole at r = 0.
  one_minus_cos = r2 * height;
  float scale = sqrt(max(0.0f, height * (2.0f - one_minus_cos)));
  vec3 t, b;
  warp_frame(axis, t, b);
  return normalize(t * (d.x * scale) + b * (d.y * scale) + axis * (1.0f - one_minus_cos));
}

// Uniform direction on the sphere; pdf 1 / (4 pi).
HW_FN vec3 warp_sphere(vec2 u) {
  float z = 1.0f - 2.0f * u.x;
  float r = sqrt(max(0.0f, 1.0f - z * z));
  float phi = 2.0f * HW_PI * u.y;
  return vec3(r * cos(phi), r * sin(phi), z);
}

// 1 - cos of the angle between two unit vectors, without the cancellation of 1 - dot(a, b).
HW_FN float warp_cap_height(vec3 a, vec3 b) {
  vec3 d = a - b;
  return 0.5f * dot(d, d);
}

HW_NAMESPACE_END
#endif
