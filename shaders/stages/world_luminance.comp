// SPDX-License-Identifier: Apache-2.0
// Luminance of the world on a latitude-longitude grid, for importance sampling. push.queue: float[a * b]; each is the mean
// of c x c directions in its cell. d: the first cell of this dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#define HW_WITH_PROGRAMS
#define HW_VM_PROCEDURAL
#include "lib/background.glsl"
#include "lib/equirect.h"
layout(local_size_x = 64) in;

void main() {
  uint i = push.d + gl_GlobalInvocationID.x;
  if (i >= push.a * push.b) return;
  vec2 cell = vec2(i % push.a, i / push.a);
  float sum = 0.0;
  uint taps = push.c * push.c;
  for (uint k = 0u; k < taps; ++k) {
    vec2 within = (vec2(k % push.c, k / push.c) + 0.5) / float(push.c);
    vec2 uv = (cell + within) / vec2(push.a, push.b);
    vec3 c = background_radiance(equirect_to_direction(uv), HW_PATH_SHADOW, 0u, 0u);
    sum += max(dot(c, vec3(0.2126, 0.7152, 0.0722)), 0.0);
  }
  FloatBuffer(push.queue).at[i] = sum / float(taps);
}
