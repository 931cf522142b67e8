// SPDX-License-Identifier: Apache-2.0
// Tangent frames, rotations, packing of unit vectors, small scalar helpers of the closures.
// Octahedral map: Cigolle et al. 2014, "A survey of efficient representations for independent unit vectors".
#ifndef HW_FRAME_H
#define HW_FRAME_H
#include "warp.h"
#ifdef __cplusplus
namespace hw {
using glm::packHalf2x16;
using glm::packSnorm2x16;
using glm::unpackHalf2x16;
using glm::unpackSnorm2x16;
}  // namespace hw
#endif
HW_NAMESPACE_BEGIN

HW_FN float square(float x) { return x * x; }
HW_FN float saturate(float x) { return clamp(x, 0.0f, 1.0f); }
HW_FN vec3 saturate3(vec3 v) { return clamp(v, vec3(0.0f), vec3(1.0f)); }
HW_FN float mean3(vec3 v) { return (v.x + v.y + v.z) * (1.0f / 3.0f); }
HW_FN float max3(vec3 v) { return max(v.x, max(v.y, v.z)); }
HW_FN float safe_sqrt(float x) { return sqrt(max(x, 0.0f)); }

// t, b, n right-handed with t as near to `tangent` as it can be; any t where the tangent is (nearly) along n.
HW_FN void frame_from_tangent(vec3 n, vec3 tangent, HW_OUT(vec3) t, HW_OUT(vec3) b) {
  vec3 side = cross(n, tangent);
  float length2 = dot(side, side);
  warp_frame(n, t, b);
  if (length2 > 1e-14f * dot(tangent, tangent) && length2 > 0.0f) {
    b = side * inversesqrt(length2);
    t = cross(b, n);
  }
}

// v turned about the unit axis by `angle` [rad], right-handed (Rodrigues).
HW_FN vec3 rotate_about(vec3 v, vec3 axis, float angle) {
  float c = cos(angle);
  return v * c + cross(axis, v) * sin(angle) + axis * (dot(axis, v) * (1.0f - c));
}

// Unit vector to 2 x 16 bit; the error is below 7e-5 rad.
HW_FN uint octahedral_pack(vec3 v) {
  float norm = abs(v.x) + abs(v.y) + abs(v.z);
  float x = v.x / norm;
  float y = v.y / norm;
  float fold_x = (1.0f - abs(y)) * (x >= 0.0f ? 1.0f : -1.0f);
  float fold_y = (1.0f - abs(x)) * (y >= 0.0f ? 1.0f : -1.0f);
  return packSnorm2x16(v.z >= 0.0f ? vec2(x, y) : vec2(fold_x, fold_y));
}
// The direction of a point of the octahedral map, in [-1, 1]^2.
HW_FN vec3 octahedral_direction(vec2 p) {
  float z = 1.0f - abs(p.x) - abs(p.y);
  float fold = max(-z, 0.0f);
  return normalize(vec3(p.x - (p.x >= 0.0f ? fold : -fold), p.y - (p.y >= 0.0f ? fold : -fold), z));
}
HW_FN vec3 octahedral_unpack(uint packed_vector) { return octahedral_direction(unpackSnorm2x16(packed_vector)); }

// Density cos/pi about z.
HW_FN vec3 square_to_cosine_hemisphere(vec2 u) {
  vec2 d = warp_disk(u);
  return vec3(d.x, d.y, safe_sqrt(1.0f - d.x * d.x - d.y * d.y));
}

HW_NAMESPACE_END
#endif
