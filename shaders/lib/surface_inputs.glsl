// SPDX-License-Identifier: Apache-2.0
// What a material program reads at a hit, filled in for whichever stage asks: surface, shadow ray, light sample.
#ifndef HW_SURFACE_INPUTS_GLSL
#define HW_SURFACE_INPUTS_GLSL
#include "geometry.glsl"
#include "material_io.glsl"

// `wo`: towards where the ray came from. Normals are turned to its side. No footprint; of the shade flags backfacing only.
MaterialInputs surface_inputs(Hit hit, SurfaceGeometry g, vec3 wo, uint ray_flags, uint bounces, uint transparent) {
  bool backfacing = dot(g.Ng, wo) < 0.0;
  MaterialInputs inputs;
  inputs.P = g.P;
  inputs.N = backfacing ? -g.N : g.N;
  inputs.Ng = backfacing ? -g.Ng : g.Ng;
  inputs.wo = wo;
  inputs.uv = vec3(g.uv, 0.0);
  inputs.bary_u = hit.u;
  inputs.bary_v = hit.v;
  inputs.instance = hit.instance;
  inputs.primitive = hit.primitive;
  inputs.material = g.material;
  inputs.ray_flags = ray_flags;
  inputs.bounces = bounces;
  inputs.transparent = transparent;
  inputs.ray_length = hit.t;
  inputs.footprint = 0.0;
  inputs.shade_flags = backfacing ? HW_SHADE_BACKFACING : 0u;
  return inputs;
}
#endif
