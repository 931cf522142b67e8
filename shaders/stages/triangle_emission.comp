// SPDX-License-Identifier: Apache-2.0
// What material programs emit on a grid over triangle lights, for choosing among them and points on them. push.queue:
// float[b * b] for each light, row by row over the square that emission maps are over (lib/emission_map.h); each is the
// mean of c x c points in its cell, seen from all sides that are sampled. push.out_queue: uint[], the lights. d: the
// first cell of this dispatch, a: the one past its last.
#version 460
#extension GL_GOOGLE_include_directive : require
#define HW_WITH_PROGRAMS
#define HW_VM_PROCEDURAL
#include "lib/triangle_emission.glsl"
#include "lib/frame.h"
#include "lib/sampler.h"
#include "lib/triangle_light.h"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = push.d + gl_GlobalInvocationID.x;
  if (i >= push.a) return;
  uint cells = push.b * push.b;
  uint index = UintBuffer(push.out_queue).at[i / cells];
  uint cell = i % cells;
  LightRecord light = light_load(index);
  bool two_sided = (light.flags & HW_LIGHT_TWO_SIDED) != 0u;
  float sum = 0.0;
  uint taps = push.c * push.c;
  for (uint k = 0u; k < taps; ++k) {
    uint random = sampler_hash(i * 0x9e3779b9u + k);
    vec2 within = (vec2(k % push.c, k / push.c) + 0.5) / float(push.c);
    vec2 uv = triangle_warp_area((vec2(cell % push.b, cell / push.b) + within) / float(push.b));
    Hit hit = triangle_light_hit(light, uv, 1.0);
    SurfaceGeometry g = surface_geometry(hit, true);
    // Some direction, sides taking turns: programs may depend on either.
    vec3 side = two_sided && (k + cell) % 2u == 1u ? -light.axis_z : light.axis_z;
    vec3 wo = normalize(side * 1.001 + warp_sphere(vec2(sampler_to_float(random), sampler_to_float(sampler_hash(random)))));
    vec3 c = max(triangle_emission(light, hit, g, wo, 0u, 0u), vec3(0.0));
    sum += (c.x + c.y + c.z) * (1.0 / 3.0);
  }
  FloatBuffer(push.queue).at[i] = sum / float(taps);
}
