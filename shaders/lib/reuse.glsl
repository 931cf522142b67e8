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
#endif
