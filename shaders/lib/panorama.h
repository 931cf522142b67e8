// SPDX-License-Identifier: Apache-2.0
// Panoramic projections, with Cycles' conventions. Picture positions go from (0, 0) bottom left to (1, 1) top right of
// the whole panorama; directions are in camera space: x right, y up, ahead along -z.
#ifndef HW_PANORAMA_H
#define HW_PANORAMA_H
#include "../shared/tables.h"
#include "warp.h"
HW_NAMESPACE_BEGIN

// At an angle from straight ahead, turned as `at` lies about the middle of the picture.
HW_FN vec3 panorama_turned(float angle, vec2 at, float radius) {
  vec2 side = radius > 0.0f ? at * (sin(angle) / radius) : vec2(0.0f);
  return vec3(side.x, side.y, -cos(angle));
}

// The direction, of unit length, of a picture position; zero where the panorama shows nothing. `range`: of the kind,
// see CameraRecord.
HW_FN vec3 panorama_to_direction(uint kind, vec4 range, vec2 p) {
  if (kind == HW_PANORAMA_FISHEYE_EQUIDISTANT) {
    vec2 at = p * 2.0f - vec2(1.0f);
    float r = length(at);
    return r > 1.0f ? vec3(0.0f) : panorama_turned(0.5f * range.x * r, at, r);
  }
  if (kind == HW_PANORAMA_FISHEYE_EQUISOLID) {
    vec2 at = (p - vec2(0.5f)) * vec2(range.z, range.w);
    float r = length(at);
    float widest = 2.0f * range.x * sin(0.25f * range.y);
    return r > widest ? vec3(0.0f) : panorama_turned(2.0f * asin(min(0.5f * r / range.x, 1.0f)), at, r);
  }
  if (kind == HW_PANORAMA_MIRROR_BALL) {  // seen from afar along -z: what the ball reflects
    vec2 at = p * 2.0f - vec2(1.0f);
    float r2 = dot(at, at);
    float c = sqrt(max(1.0f - r2, 0.0f));
    return r2 > 1.0f ? vec3(0.0f) : vec3(2.0f * c * at.x, 2.0f * c * at.y, 1.0f - 2.0f * c * c);
  }
  if (kind == HW_PANORAMA_CUBE_FACE) {
    vec2 angle = (p - vec2(0.5f)) * (0.5f * HW_PI);
    return normalize(vec3(tan(angle.x), tan(angle.y), -1.0f));
  }
  float across = mix(range.x, range.y, p.x);
  float up = mix(range.z, range.w, p.y);
  if (kind == HW_PANORAMA_CYLINDRICAL) return normalize(vec3(sin(across), up, -cos(across)));
  return vec3(cos(up) * sin(across), sin(up), -cos(up) * cos(across));
}

// The picture position that a direction is seen at, of any length; beyond [0, 1] where it is not in the picture.
HW_FN vec2 panorama_from_direction(uint kind, vec4 range, vec3 d) {
  float side = sqrt(d.x * d.x + d.y * d.y);
  vec2 turn = side > 0.0f ? vec2(d.x, d.y) / side : vec2(0.0f);
  float angle = atan(side, -d.z);  // from straight ahead
  if (kind == HW_PANORAMA_FISHEYE_EQUIDISTANT) return turn * (angle / range.x) + vec2(0.5f);
  if (kind == HW_PANORAMA_FISHEYE_EQUISOLID)
    return turn * (2.0f * range.x * sin(0.5f * angle)) / vec2(range.z, range.w) + vec2(0.5f);
  if (kind == HW_PANORAMA_MIRROR_BALL) return turn * (0.5f * sin(0.5f * angle)) + vec2(0.5f);
  if (kind == HW_PANORAMA_CUBE_FACE) return vec2(atan(d.x, -d.z), atan(d.y, -d.z)) * (2.0f * HW_INV_PI) + vec2(0.5f);
  float flat_length = sqrt(d.x * d.x + d.z * d.z);
  float across = flat_length > 0.0f ? atan(d.x, -d.z) : 0.5f * (range.x + range.y);
  float up = kind == HW_PANORAMA_CYLINDRICAL ? d.y / max(flat_length, 1e-20f) : atan(d.y, flat_length);
  return vec2((across - range.x) / (range.y - range.x), (up - range.z) / (range.w - range.z));
}

// The angle [rad] that the whole panorama is wide.
HW_FN float panorama_width(uint kind, vec4 range) {
  if (kind == HW_PANORAMA_FISHEYE_EQUIDISTANT) return range.x;
  if (kind == HW_PANORAMA_FISHEYE_EQUISOLID) return 4.0f * asin(min(0.25f * range.z / range.x, 1.0f));
  if (kind == HW_PANORAMA_MIRROR_BALL) return 2.0f * HW_PI;
  return kind == HW_PANORAMA_CUBE_FACE ? 0.5f * HW_PI : range.y - range.x;
}

HW_NAMESPACE_END
#endif
