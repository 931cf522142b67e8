// SPDX-License-Identifier: Apache-2.0
// What the stages of reuse share: their parameters, target values by light index.
#ifndef HW_REUSE_GLSL
#define HW_REUSE_GLSL
#include "wave.glsl"
#include "closures.h"
#include "light_choice.glsl"
#include "random.h"
#include "reservoir.h"
#include "reuse_target.h"

#define HW_REUSE HW_FRAME.reuse
bool reuse_has(uint flag) { return (HW_REUSE.flags & flag) != 0u; }

// p_hat of a light at a surface; 0 for no light.
float reuse_target_of(TargetSurface s, uint light) {
  if (light >= HW_ROOT.light_count) return 0.0;
  return target_value(s, LightProxyArray(HW_REUSE.proxies).at[light], HW_REUSE.light_mis_scale);
}

// A reservoir of the last frame in this one: its light by this frame's index, its past counted as the frame says. The
// sample of a light that is gone is dropped; its confidence stays, as it stands for all that were looked at.
Reservoir reservoir_next_frame(Reservoir r) {
  if (r.light != HW_NONE && HW_REUSE.light_remap != 0ul) {
    uint now = r.light < HW_REUSE.light_remap_count ? UintArray(HW_REUSE.light_remap).at[r.light] : HW_NONE;
    r.light = now;
    if (now == HW_NONE) r = reservoir_empty(r.confidence);
  }
  r.confidence *= HW_REUSE.history_share;
  return r;
}
#endif
