// SPDX-License-Identifier: Apache-2.0
// Radiance of the world along a direction: a constant, or the world's program (in kernel variants with HW_WITH_PROGRAMS).
#ifndef HW_BACKGROUND_GLSL
#define HW_BACKGROUND_GLSL
#ifdef HW_WITH_PROGRAMS
#include "material_vm.glsl"
#endif
#include "wave.glsl"

// `ray_flags`, `bounces`, `transparent`: of the path that asks, for the Light Path node.
vec3 background_radiance(vec3 direction, uint ray_flags, uint bounces, uint transparent) {
  vec3 radiance = HW_ROOT.world_color;
#ifdef HW_WITH_PROGRAMS
  uint material = HW_ROOT.world_material;
  if (HW_HAS(HW_FEATURE_WORLD_PROGRAM)) {
    if (material != HW_NONE) {
      MaterialInputs inputs = background_inputs(material, direction, ray_flags, bounces, transparent);
      radiance = material_emission(inputs);
    }
  }
#endif
  return radiance;
}

// Which visibility bit of a light (HW_LIGHT_*) a ray of this type asks for.
uint light_visibility_bit(uint ray_flags) {
  return (ray_flags & HW_PATH_CAMERA) != 0u         ? HW_LIGHT_CAMERA
         : (ray_flags & HW_PATH_TRANSMISSION) != 0u ? HW_LIGHT_TRANSMISSION
         : (ray_flags & HW_PATH_DIFFUSE) != 0u      ? HW_LIGHT_DIFFUSE
                                                    : HW_LIGHT_GLOSSY;
}
#endif
