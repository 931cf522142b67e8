// SPDX-License-Identifier: Apache-2.0
// Draws a light by the alias table, then a point on it (Vose 1991 for the table). The pdf counts both choices.
#ifndef HW_LIGHT_CHOICE_GLSL
#define HW_LIGHT_CHOICE_GLSL
#include "background.glsl"
#include "geometry.glsl"
#include "light_sampling.h"
#include "world_sampling.h"

struct LightDraw {
  vec3 wi;
  float distance;   // HW_INFINITY: at infinity
  vec3 radiance;
  float pdf;        // solid angle, choice included
  vec3 normal;      // of the light at the point
  uint flags;       // of the light, HW_LIGHT_*
  uint light;
  bool delta;
  bool valid;
};

// Picks an entry of an alias table of n entries with one uniform number.
uint alias_pick(uint64_t table, uint n, float u) {
  float scaled = u * float(n);
  uint i = min(uint(scaled), n - 1u);
  AliasEntry e = AliasTable(table).at[i];
  return scaled - float(i) < e.threshold ? i : e.alias;
}

#ifdef HW_WITH_PROGRAMS
// Emission of a textured triangle light at the sampled point, by its material's program.
vec3 triangle_program_emission(LightRecord light, LightSample s, vec3 P, uint bounces, uint transparent) {
  Hit hit;
  hit.t = s.distance;
  hit.u = s.uv.x;
  hit.v = s.uv.y;
  hit.instance = light.instance;
  hit.primitive = light.primitive;
  SurfaceGeometry g = surface_geometry(hit, true);
  bool backfacing = dot(g.Ng, s.wi) > 0.0;
  MaterialInputs inputs;
  inputs.P = g.P;
  inputs.N = backfacing ? -g.N : g.N;
  inputs.Ng = backfacing ? -g.Ng : g.Ng;
  inputs.wo = -s.wi;
  inputs.uv = vec3(g.uv, 0.0);
  inputs.bary_u = hit.u;
  inputs.bary_v = hit.v;
  inputs.instance = hit.instance;
  inputs.primitive = hit.primitive;
  inputs.material = light.material;
  // Seen as a shadow ray's end, as Cycles evaluates emission for light samples.
  inputs.ray_flags = HW_PATH_SHADOW;
  inputs.bounces = bounces;
  inputs.transparent = transparent;
  inputs.ray_length = s.distance;
  inputs.footprint = 0.0;
  inputs.shade_flags = backfacing ? HW_SHADE_BACKFACING : 0u;
  return material_emission(inputs);
}
#endif

LightDraw draw_light(vec3 P, float u, vec2 u2, uint ray_flags, uint bounces, uint transparent) {
  LightDraw d;
  d.valid = false;
  uint index = alias_pick(HW_ROOT.light_alias, HW_ROOT.light_count, u);
  float choice = AliasTable(HW_ROOT.light_alias).at[index].pdf;
  LightRecord light = LightTable(HW_ROOT.lights).at[index];
  d.light = index;
  d.flags = light.flags;
  d.delta = false;
  if (light.type == HW_LIGHT_WORLD) {
    world_sample(HW_ROOT.world, u2, d.wi, d.pdf);
    d.distance = HW_INFINITY;
    d.normal = -d.wi;
    d.flags = HW_ROOT.world_flags | HW_LIGHT_CAST_SHADOW;
    d.radiance = vec3(0.0);
    if (d.pdf > 0.0) d.radiance = background_radiance(d.wi, HW_PATH_SHADOW, bounces, transparent);
  } else {
    LightSample s;
    bool ok = light_sample(light, P, vec3(u2, 0.0), s);
    d.wi = s.wi;
    d.distance = s.distance;
    d.normal = s.normal;
    d.radiance = s.radiance;
    d.pdf = ok ? s.pdf : 0.0;
    d.delta = (s.flags & HW_LIGHT_SAMPLE_DELTA) != 0u;
#ifdef HW_WITH_PROGRAMS
    if (HW_HAS(HW_FEATURE_EMISSION_PROGRAM)) {
      if (ok && (light.flags & HW_LIGHT_SHADER) != 0u) d.radiance = triangle_program_emission(light, s, P, bounces, transparent);
    }
#endif
  }
  d.pdf *= choice;
  d.valid = d.pdf > 0.0;
  return d;
}
#endif
