// SPDX-License-Identifier: Apache-2.0
// White noise, magic and brick textures with the semantics of Blender's nodes. Checker, gradient and wave are made of
// core rows and noise by the assembler (headwater/materials/textures.py).
#ifndef HW_PATTERNS_H
#define HW_PATTERNS_H
#include "hash.h"
#include "math_ops.h"
HW_NAMESPACE_BEGIN

// HW_OP_WHITE_NOISE: sub = dimensions | colour << 4. One dimension reads w.
HW_FN vec3 white_noise(uint sub, vec3 p, float w) {
  uint dims = sub & 15u;
  if (dims == 1u) {
    float value = hash_floats(w, 0.0f, 0.0f, 0.0f, 1u);
    return (sub & 16u) == 0u ? vec3(value)
                             : vec3(value, hash_floats(w, 1.0f, 0.0f, 0.0f, 2u), hash_floats(w, 2.0f, 0.0f, 0.0f, 2u));
  }
  float value = hash_floats(p.x, p.y, p.z, w, dims);
  if ((sub & 16u) == 0u) {
    return vec3(value);
  }
  if (dims == 2u) {
    return vec3(value, hash_floats(p.x, p.y, 1.0f, 0.0f, 3u), hash_floats(p.x, p.y, 2.0f, 0.0f, 3u));
  }
  if (dims == 3u) {
    return vec3(value, hash_floats(p.x, p.y, p.z, 1.0f, 4u), hash_floats(p.x, p.y, p.z, 2.0f, 4u));
  }
  return vec3(value, hash_floats(p.z, p.x, w, p.y, 4u), hash_floats(w, p.z, p.y, p.x, 4u));
}

// HW_OP_MAGIC: `p` unscaled, taken modulo 2 pi, then times 5 * scale. Each step replaces one of x, y, z by a signed
// sine or cosine of a signed sum of the three, times the distortion.
HW_FN vec3 magic_texture(uint depth, vec3 p, float scale, float distortion) {
  const float turn = 6.2831853071795864769f;
  float px = truncated_modulo(p.x, turn);
  float py = truncated_modulo(p.y, turn);
  float pz = truncated_modulo(p.z, turn);
  float k = 5.0f * scale;
  float x = sin((px + py + pz) * k);
  float y = cos((py - px - pz) * k);
  float z = -cos((pz - px - py) * k);
  float d = depth > 0u ? distortion : 1.0f;
  x *= d;
  y *= d;
  z *= d;
  if (depth > 0u) {
    y = -cos(x - y + z) * d;
  }
  if (depth > 1u) {
    x = cos(x - y - z) * d;
  }
  if (depth > 2u) {
    z = sin(-x - y - z) * d;
  }
  if (depth > 3u) {
    x = -cos(y - x - z) * d;
  }
  if (depth > 4u) {
    y = -sin(y - x + z) * d;
  }
  if (depth > 5u) {
    y = -cos(y - x + z) * d;
  }
  if (depth > 6u) {
    x = cos(x + y + z) * d;
  }
  if (depth > 7u) {
    z = sin(x + y - z) * d;
  }
  if (depth > 8u) {
    x = -cos(z - x - y) * d;
  }
  if (depth > 9u) {
    y = -sin(x - y + z) * d;
  }
  float norm = distortion != 0.0f ? 0.5f / distortion : 1.0f;
  return vec3(0.5f - x * norm, 0.5f - y * norm, 0.5f - z * norm);
}

// HW_OP_BRICK: `p` scaled. Returns (tint of the brick, mortar, 0), each 0..1.
HW_FN vec3 brick_texture(uint sub, vec3 p, vec3 b, vec3 c, float squash) {
  int offset_every = int(sub & 255u);
  int squash_every = int(sub >> 8u);
  float mortar_size = b.x;
  float mortar_smooth = b.y;
  float width = c.x;
  float height = c.y;
  float row_f = floor(divide_or_zero(p.y, height));
  int row = int(clamp(row_f, -2147483000.0f, 2147483000.0f));
  float shift = 0.0f;
  if (offset_every > 0 && squash_every > 0) {
    width *= row % squash_every != 0 ? 1.0f : squash;
    shift = row % offset_every != 0 ? 0.0f : width * c.z;
  }
  float column_f = floor(divide_or_zero(p.x + shift, width));
  int column = int(clamp(column_f, -2147483000.0f, 2147483000.0f));
  float x = p.x + shift - width * float(column);
  float y = p.y - height * float(row);
  uint n = ((uint(row) << 16u) + (uint(column) & 0xFFFFu) + 1013u) & 0x7FFFFFFFu;
  n = (n >> 13u) ^ n;
  uint m = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7FFFFFFFu;
  float tint = clamp(float(m) * (0.5f / 1073741824.0f) + b.z, 0.0f, 1.0f);
  float inside = min(min(x, y), min(width - x, height - y));
  float t = clamp(divide_or_zero(1.0f - divide_or_zero(inside, mortar_size), mortar_smooth), 0.0f, 1.0f);
  float mortar = mortar_smooth == 0.0f ? 1.0f : t * t * (3.0f - 2.0f * t);
  return vec3(tint, inside >= mortar_size ? 0.0f : mortar, 0.0f);
}

HW_NAMESPACE_END
#endif
