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

// The angle from straight ahead that a fisheye's polynomial has at a distance from the middle of its sensor. Cycles
// turns by minus the polynomial.
HW_FN float panorama_polynomial(float first, vec4 lens, float r) {
  return -(first + r * (lens.x + r * (lens.y + r * (lens.z + r * lens.w))));
}

// The distance at which it has an angle, by Newton's method.
HW_FN float panorama_polynomial_inverse(float first, vec4 lens, float widest, float angle) {
  float r = lens.x != 0.0f ? max(-(angle + first) / lens.x, 0.0f) : 0.5f * widest;
  for (int i = 0; i < 8; ++i) {
    float slope = -(lens.x + r * (2.0f * lens.y + r * (3.0f * lens.z + r * 4.0f * lens.w)));
    float off = panorama_polynomial(first, lens, r) - angle;
    r = abs(slope) > 1e-8f ? clamp(r - off / slope, 0.0f, 4.0f * widest) : r;
  }
  return r;
}

// The direction, of unit length, of a picture position; zero where the panorama shows nothing. `range`, `lens`: of the
// kind, see CameraRecord.
HW_FN vec3 panorama_to_direction(uint kind, vec4 range, vec4 lens, vec2 p) {
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
  if (kind == HW_PANORAMA_FISHEYE_POLYNOMIAL) {
    vec2 at = (p - vec2(0.5f)) * vec2(range.z, range.w);
    float r = length(at);
    float angle = panorama_polynomial(range.y, lens, r);
    return abs(angle) > 0.5f * range.x ? vec3(0.0f) : panorama_turned(angle, at, r);
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
HW_FN vec2 panorama_from_direction(uint kind, vec4 range, vec4 lens, vec3 d) {
  float side = sqrt(d.x * d.x + d.y * d.y);
  vec2 turn = side > 0.0f ? vec2(d.x, d.y) / side : vec2(0.0f);
  float angle = atan(side, -d.z);  // from straight ahead
  if (kind == HW_PANORAMA_FISHEYE_EQUIDISTANT) return turn * (angle / range.x) + vec2(0.5f);
  if (kind == HW_PANORAMA_FISHEYE_EQUISOLID)
    return turn * (2.0f * range.x * sin(0.5f * angle)) / vec2(range.z, range.w) + vec2(0.5f);
  if (kind == HW_PANORAMA_FISHEYE_POLYNOMIAL) {
    // A polynomial that turns the other way mirrors the picture.
    float way = panorama_polynomial(0.0f, lens, 0.5f * range.z) < 0.0f ? -1.0f : 1.0f;
    float r = panorama_polynomial_inverse(range.y, lens, max(range.z, range.w), way * angle);
    return turn * (way * r) / vec2(range.z, range.w) + vec2(0.5f);
  }
  if (kind == HW_PANORAMA_MIRROR_BALL) return turn * (0.5f * sin(0.5f * angle)) + vec2(0.5f);
  if (kind == HW_PANORAMA_CUBE_FACE) return vec2(atan(d.x, -d.z), atan(d.y, -d.z)) * (2.0f * HW_INV_PI) + vec2(0.5f);
  float flat_length = sqrt(d.x * d.x + d.z * d.z);
  float across = flat_length > 0.0f ? atan(d.x, -d.z) : 0.5f * (range.x + range.y);
  float up = kind == HW_PANORAMA_CYLINDRICAL ? d.y / max(flat_length, 1e-20f) : atan(d.y, flat_length);
  return vec2((across - range.x) / (range.y - range.x), (up - range.z) / (range.w - range.z));
}

// The angle [rad] that the whole panorama is wide.
HW_FN float panorama_width(uint kind, vec4 range, vec4 lens) {
  if (kind == HW_PANORAMA_FISHEYE_POLYNOMIAL)
    return 2.0f * abs(panorama_polynomial(range.y, lens, 0.5f * range.z) - panorama_polynomial(range.y, lens, 0.0f));
  if (kind == HW_PANORAMA_FISHEYE_EQUIDISTANT) return range.x;
  if (kind == HW_PANORAMA_FISHEYE_EQUISOLID) return 4.0f * asin(min(0.25f * range.z / range.x, 1.0f));
  if (kind == HW_PANORAMA_MIRROR_BALL) return 2.0f * HW_PI;
  return kind == HW_PANORAMA_CUBE_FACE ? 0.5f * HW_PI : range.y - range.x;
}

HW_NAMESPACE_END
#endif
