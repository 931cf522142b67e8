// SPDX-License-Identifier: Apache-2.0
// Arithmetic of material programs: the core tier's operations and the scalar transcendental functions, with the
// conventions of Blender's Math nodes where a result is undefined (0, never NaN).
#ifndef HW_MATH_OPS_H
#define HW_MATH_OPS_H
#include "../shared/material_program.h"
HW_NAMESPACE_BEGIN

HW_FN float divide_or_zero(float a, float b) { return b != 0.0f ? a / b : 0.0f; }
HW_FN float component_of(vec3 v, uint i) { return i == 0u ? v.x : (i == 1u ? v.y : v.z); }
// C's fmod: the remainder has the sign of a. b must not be 0.
HW_FN float truncated_modulo(float a, float b) {
  float q = a / b;
  return a - b * (q < 0.0f ? -floor(-q) : floor(q));
}

// Result of a core row. Everything is computed and one result chosen: a row costs the same whatever its opcode, on an
// implementation that runs both sides of branches anyway.
HW_FN vec3 core_op(uint op, uint sub, vec3 a, vec3 b, vec3 c) {
  vec3 r = a * b + c;
  if (op == HW_OP_MIX) {
    r = a + (b - a) * c;
  }
  if (op == HW_OP_DIV) {
    r = vec3(divide_or_zero(a.x, b.x), divide_or_zero(a.y, b.y), divide_or_zero(a.z, b.z));
  }
  if (op == HW_OP_MIN) {
    r = min(a, b);
  }
  if (op == HW_OP_MAX) {
    r = max(a, b);
  }
  if (op == HW_OP_LESS) {
    r = vec3(a.x < b.x ? 1.0f : 0.0f, a.y < b.y ? 1.0f : 0.0f, a.z < b.z ? 1.0f : 0.0f);
  }
  if (op == HW_OP_FLOOR) {
    r = floor(a);
  }
  if (op == HW_OP_SQRT) {
    r = sqrt(max(a, vec3(0.0f)));
  }
  if (op == HW_OP_DOT) {
    r = vec3(dot(a, b));
  }
  if (op == HW_OP_CROSS) {
    r = cross(a, b);
  }
  if (op == HW_OP_NORMALIZE) {
    float length2 = dot(a, a);
    r = a * (length2 > 0.0f ? 1.0f / sqrt(length2) : 0.0f);
  }
  if (op == HW_OP_COMBINE) {
    r = vec3(component_of(a, sub & 3u), component_of(b, (sub >> 2u) & 3u), component_of(c, (sub >> 4u) & 3u));
  }
  if (op == HW_OP_SELECT) {
    r = vec3(c.x != 0.0f ? b.x : a.x, c.y != 0.0f ? b.y : a.y, c.z != 0.0f ? b.z : a.z);
  }
  return r;
}

// a to the power b; 1 for b = 0, 0 for a negative a with b not whole.
HW_FN float power_or_zero(float a, float b) {
  bool whole = b == floor(b);
  bool odd = whole && b != 2.0f * floor(b * 0.5f);
  float magnitude = pow(max(abs(a), 1e-38f), b);
  float r = a < 0.0f ? (whole ? (odd ? -magnitude : magnitude) : 0.0f) : (a == 0.0f ? 0.0f : magnitude);
  return b == 0.0f ? 1.0f : r;
}

// HW_OP_MATH: scalar functions, `function` is HW_MATH_*.
HW_FN float scalar_function(uint function, float a, float b) {
  float r = power_or_zero(a, b);
  if (function == HW_MATH_LOG) {
    r = a > 0.0f && b > 0.0f ? divide_or_zero(log(max(a, 1e-45f)), log(max(b, 1e-45f))) : 0.0f;
  }
  if (function == HW_MATH_EXP) {
    r = exp(a);
  }
  if (function == HW_MATH_SIN) {
    r = sin(a);
  }
  if (function == HW_MATH_COS) {
    r = cos(a);
  }
  if (function == HW_MATH_TAN) {
    r = tan(a);
  }
  if (function == HW_MATH_ASIN) {
    r = asin(clamp(a, -1.0f, 1.0f));
  }
  if (function == HW_MATH_ACOS) {
    r = acos(clamp(a, -1.0f, 1.0f));
  }
  if (function == HW_MATH_ATAN2) {
    r = a == 0.0f && b == 0.0f ? 0.0f : atan(a, b);
  }
  float e = exp(min(abs(a), 88.0f));
  if (function == HW_MATH_SINH) {
    float r0 = abs(a) < 0.01f ? a * (1.0f + a * a / 6.0f) : (e - 1.0f / e) * (a < 0.0f ? -0.5f : 0.5f);
    r = r0;
  }
  if (function == HW_MATH_COSH) {
    r = 0.5f * (e + 1.0f / e);
  }
  if (function == HW_MATH_TANH) {
    float e2 = exp(-2.0f * min(abs(a), 44.0f));
    float t = (1.0f - e2) / (1.0f + e2);
    r = abs(a) < 0.01f ? a * (1.0f - a * a / 3.0f) : (a < 0.0f ? -t : t);
  }
  return r;
}

// Direction (any length) to mirror-ball texture coordinates: the ball is seen from -y, as Blender's Environment Texture
// has it. Inverse of reflecting (0, -1, 0) about the ball's normal at that point.
HW_FN vec2 mirror_ball_from_direction(vec3 direction) {
  float length2 = dot(direction, direction);
  vec3 half_vector = direction * (length2 > 0.0f ? 1.0f / sqrt(length2) : 0.0f);
  half_vector.y -= 1.0f;
  float norm = 2.0f * sqrt(max(-0.5f * half_vector.y, 0.0f));
  float scale = norm > 0.0f ? 0.5f / norm : 0.5f;
  return vec2(half_vector.x * scale + 0.5f, half_vector.z * scale + 0.5f);
}

// Normal of a height field over a surface (Mikkelsen 2010, "Bump mapping unparametrized surfaces on the GPU").
// h: height here, at dPdx, at dPdy, the three in `dPdx`'s unit divided by `width`; strength blends with N.
HW_FN vec3 bump_normal(vec3 h, vec3 dPdx, vec3 dPdy, vec3 N, float strength, float distance_, float width) {
  vec3 rx = cross(dPdy, N);
  vec3 ry = cross(N, dPdx);
  float det = dot(dPdx, rx);
  vec3 gradient = rx * (h.y - h.x) + ry * (h.z - h.x);
  vec3 bumped = N * (width * abs(det)) - gradient * (det < 0.0f ? -distance_ : distance_);
  float s = max(strength, 0.0f);
  float length2 = dot(bumped, bumped);
  vec3 blended = bumped * (length2 > 0.0f ? s / sqrt(length2) : 0.0f) + N * (1.0f - s);
  float blended2 = dot(blended, blended);
  return blended2 > 0.0f && length2 > 0.0f ? blended * (1.0f / sqrt(blended2)) : N;
}

HW_NAMESPACE_END
#endif
