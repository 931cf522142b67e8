// SPDX-License-Identifier: Apache-2.0
// Adds emission that a camera or BSDF ray ran into.
#ifndef HW_FOUND_LIGHT_GLSL
#define HW_FOUND_LIGHT_GLSL
#include "wave.glsl"

// `weight`: MIS weight against next-event estimation.
void found_light(uint path, PathState state, vec3 radiance, float weight) {
  vec3 diffuse = vec3(0.0), glossy = vec3(0.0);
  if (HW_LIGHT_PASSES) {
    PathSplit split = SplitArray(HW_FRAME.splits).at[path];
    diffuse = split.diffuse;
    glossy = split.glossy;
  }
  result_add_light(path, state.throughput * radiance * weight, path_bounce(state.bounces), diffuse, glossy);
}
#endif
