// SPDX-License-Identifier: Apache-2.0
// Emission of a triangle light at a point of it, by its material's program.
#ifndef HW_TRIANGLE_EMISSION_GLSL
#define HW_TRIANGLE_EMISSION_GLSL
#include "geometry.glsl"
#include "material_vm.glsl"
#include "surface_inputs.glsl"

Hit triangle_light_hit(LightRecord light, vec2 uv, float t) {
  Hit hit;
  hit.t = t;
  hit.u = uv.x;
  hit.v = uv.y;
  hit.instance = light.instance;
  hit.primitive = light.primitive;
  return hit;
}

// `wo`: towards who sees it. Seen as a shadow ray's end, as Cycles evaluates emission for light samples.
vec3 triangle_emission(LightRecord light, Hit hit, SurfaceGeometry g, vec3 wo, uint bounces, uint transparent) {
  MaterialInputs inputs = surface_inputs(hit, g, wo, HW_PATH_SHADOW, bounces, transparent);
  inputs.material = light.material;
  return material_emission(inputs);
}
#endif
