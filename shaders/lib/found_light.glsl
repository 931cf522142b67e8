// SPDX-License-Identifier: Apache-2.0
// Adds emission that a camera or BSDF ray ran into.
#ifndef HW_FOUND_LIGHT_GLSL
#define HW_FOUND_LIGHT_GLSL
#include "path_reuse.glsl"
#include "wave.glsl"

// `weight`: MIS weight against next-event estimation.
void found_light(uint path, PathState state, vec3 radiance, float weight) {
  vec3 diffuse = vec3(0.0), glossy = vec3(0.0);
  if (HW_LIGHT_PASSES) {
    PathSplit split = SplitArray(HW_FRAME.splits).at[path];
    diffuse = split.diffuse;
    glossy = split.glossy;
  }
  // Until a surface has given its own, the denoising albedo of what shines is its light, as in Cycles.
  if (HW_FEATURE_PASSES) {
    if (pass_on(HW_PASS_DENOISING_ALBEDO) && (state.flags & HW_PATH_FEATURES_DONE) == 0u) {
      // Of split paths one speaks for all.
      float share = (state.flags & HW_PATH_SPLIT) != 0u ? float(HW_FRAME.bounce_samples) : 1.0;
      result_add3(path, HW_PASS_DENOISING_ALBEDO,
                  SplitArray(HW_FRAME.splits).at[path].feature * state.throughput * radiance * (weight * share));
    }
  }
  bool split = (state.flags & HW_PATH_SPLIT) != 0u;
  vec3 light = result_clamp(state.throughput * radiance * weight, path_bounce(state.bounces), split);
  if (HW_PATH_REUSE) {
    if ((state.flags & HW_PATH_SHARED) != 0u) light -= reuse_put(path, light, false);
  }
  result_add_light(path, light, path_bounce(state.bounces), split, diffuse, glossy);
}
#endif
