// SPDX-License-Identifier: Apache-2.0
// What a material program reads and leaves behind. Stages fill MaterialInputs and call material_vm.glsl.
#ifndef HW_MATERIAL_IO_GLSL
#define HW_MATERIAL_IO_GLSL
#include "../shared/material_program.h"
#include "tables.glsl"
#include "closure_builders.h"

struct MaterialInputs {
  vec3 P;              // world; background: the direction looked in
  vec3 N;              // shading normal, unit, on the viewer's side; background: -direction
  vec3 Ng;             // geometric normal, unit, on the viewer's side
  vec3 wo;             // towards the viewer, unit
  vec3 uv;             // default UV map (u, v, 0)
  float bary_u;        // as Hit has them
  float bary_v;
  uint instance;       // HW_NONE for a background
  uint primitive;
  uint material;       // index into Root::materials
  uint ray_flags;      // HW_PATH_* ray-type bits of the ray that asks; shadow rays HW_PATH_SHADOW
  uint bounces;        // as PathState: total | diffuse << 8 | glossy << 16 | transmission << 24
  uint transparent;    // transparent bounces so far
  float ray_length;    // distance from the last vertex
  float footprint;     // width of a pixel at P, world units (bump mapping); 0 where unknown
  uint shade_flags;    // HW_SHADE_* (shared/closure.h), backfacing among them
};

// Zeroed by shader_output_reset before a program runs.
struct ShaderOutput {
  ClosureList closures;
  vec3 emission;       // radiance towards wo; for a background program the background's radiance
  vec3 transparency;   // share of light let straight through
  vec3 holdout;        // share that cuts a hole into the film
};

#endif
