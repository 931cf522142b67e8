// SPDX-License-Identifier: Apache-2.0
// Draws a light by the alias table (Vose 1991) or the light tree (lib/light_tree.h), then a point on it. The pdf counts
// both choices.
#ifndef HW_LIGHT_CHOICE_GLSL
#define HW_LIGHT_CHOICE_GLSL
#include "tables.glsl"
#include "features.glsl"
#include "light_cells.glsl"
#include "light_sampling.h"
#include "light_tree.glsl"
#include "world_sampling.h"
#ifdef HW_RESERVOIR
#include "light_point.h"
#endif

struct LightDraw {
  vec3 wi;
  float distance;   // HW_INFINITY: at infinity
  vec3 radiance;    // 1 where `program` is set
  float pdf;        // solid angle, choice included
  float mis_pdf;    // the same as BSDF rays are weighed with
  vec3 normal;      // of the light at the point
  uint flags;       // of the light, HW_LIGHT_*
  uint light;
  bool delta;
  bool program;     // its emission is a program's: light_program.comp brings it in
  vec2 uv;          // where on a triangle light
  bool valid;
};

// Picks an entry of an alias table of n entries with one uniform number.
uint alias_pick(uint64_t table, uint n, float u) {
  float scaled = u * float(n);
  uint i = min(uint(scaled), n - 1u);
  uint64_t e = table + uint64_t(i) * HW_ALIAS_BYTES;
  return scaled - float(i) < float_at(e, 0u) ? i : uint_at(e, 1u);
}

// Probability of a light by the alias table.
float alias_pdf(uint light) { return float_at(HW_ROOT.light_alias + uint64_t(light) * HW_ALIAS_BYTES, 2u); }

// Chooses a light for a surface at P with the unit normal N, which does not matter where it `transmits`. HW_NONE with
// choice 0: none can contribute.
uint light_choice(vec3 P, vec3 N, bool transmits, float u, out float choice) {
  if (HW_HAS(HW_FEATURE_LIGHT_TREE)) return light_tree_sample(0u, P, N, transmits, u, choice);
  uint index = alias_pick(HW_ROOT.light_alias, HW_ROOT.light_count, u);
  choice = alias_pdf(index);
  return index;
}

// The chance with which light_choice gives `light`, which MIS weighs BSDF rays from `origin` with.
float light_choice_pdf(uint light, vec3 origin, vec3 normal, bool transmits) {
  if (HW_HAS(HW_FEATURE_LIGHT_TREE)) return light_tree_pdf(0u, light, origin, normal, transmits);
  return alias_pdf(light);
}
// The same from a path's last vertex, for a light that its ray has found.
float light_choice_pdf(uint light, PathState state) {
  if (HW_HAS(HW_FEATURE_LIGHT_CELLS))
    return light_cell_pdf(state.mis_cell, light, state.mis_origin, octahedral_unpack(state.mis_normal),
                          (state.mis_normal & HW_RECEIVER_TRANSMITS) != 0u);
  return light_choice_pdf(light, state.mis_origin, octahedral_unpack(state.mis_normal),
                          (state.mis_normal & HW_RECEIVER_TRANSMITS) != 0u);
}

// A point on a light, for a surface at P. `weight` takes the place of 1 / probability of the light; `mis_choice`: that
// probability as MIS counts it.
LightDraw draw_on_light(vec3 P, uint index, float weight, float mis_choice, vec2 u2) {
  LightDraw d;
  d.valid = false;
  if (index >= HW_ROOT.light_count || !(weight > 0.0)) return d;
  LightRecord light = light_load(index);
  d.light = index;
  d.flags = light.flags;
  d.delta = false;
  d.program = false;
  d.uv = vec2(0.0);
  if (HW_LIT_BY(HW_KIND_WORLD) && light.type == HW_LIGHT_WORLD) {
    world_sample(HW_ROOT.world, u2, d.wi, d.pdf);
    d.distance = HW_INFINITY;
    d.normal = -d.wi;
    d.flags = HW_ROOT.world_flags | HW_LIGHT_CAST_SHADOW;
    d.program = HW_HAS(HW_FEATURE_WORLD_PROGRAM) && HW_ROOT.world_material != HW_NONE;
    d.radiance = d.program ? vec3(1.0) : HW_ROOT.world_color;
  } else {
    LightSample s;
    bool ok = light_sample(light, HW_ROOT.emission_maps, P, vec3(u2, 0.0), s);
    d.wi = s.wi;
    d.distance = s.distance;
    d.normal = s.normal;
    d.radiance = s.radiance;
    d.pdf = ok ? s.pdf : 0.0;
    d.delta = (s.flags & HW_LIGHT_SAMPLE_DELTA) != 0u;
    d.uv = s.uv;
    d.program = HW_HAS(HW_FEATURE_EMISSION_PROGRAM) && (light.flags & HW_LIGHT_SHADER) != 0u;
    if (d.program) d.radiance = vec3(1.0);
  }
  d.mis_pdf = d.pdf * mis_choice;
  d.pdf /= weight;
  d.valid = d.pdf > 0.0;
  return d;
}

// A light and a point on it, for a surface at P (see light_choice).
LightDraw draw_light(vec3 P, vec3 N, bool transmits, float u, vec2 u2) {
  float choice;
  uint index = light_choice(P, N, transmits, u, choice);
  return draw_on_light(P, index, choice > 0.0 ? 1.0 / choice : 0.0, choice, u2);
}

#ifdef HW_RESERVOIR
// The draw that a reservoir stands for: its contribution weight takes the place of 1 / pdf. `mis_scale`: see
// ReuseFrame::light_mis_scale.
LightDraw draw_reservoir(vec3 P, Reservoir r, float mis_scale) {
  LightDraw d;
  d.valid = false;
  if (r.light >= HW_ROOT.light_count || !(r.weight > 0.0)) return d;
  LightRecord light = light_load(r.light);
  bool world = HW_LIT_BY(HW_KIND_WORLD) && light.type == HW_LIGHT_WORLD;
  LightPoint p = light_point(light, vec2(r.u, r.v), P);
  d.wi = p.wi;
  d.distance = p.distance;
  d.normal = p.normal;
  d.delta = p.delta;
  d.light = r.light;
  d.uv = vec2(r.u, r.v);
  d.flags = world ? HW_ROOT.world_flags | HW_LIGHT_CAST_SHADOW : light.flags;
  d.program = world ? HW_HAS(HW_FEATURE_WORLD_PROGRAM) && HW_ROOT.world_material != HW_NONE
                    : HW_HAS(HW_FEATURE_EMISSION_PROGRAM) && (light.flags & HW_LIGHT_SHADER) != 0u;
  d.radiance = d.program ? vec3(1.0) : world ? HW_ROOT.world_color : p.radiance;
  float weight = p.density * r.weight;
  d.pdf = 1.0 / max(weight, 1e-30);
  d.mis_pdf = mis_scale * alias_pdf(r.light) *
              light_point_mis_pdf(light, HW_ROOT.emission_maps, HW_ROOT.world, P, p, d.uv);
  d.valid = weight > 0.0;
  return d;
}
#endif
#endif
