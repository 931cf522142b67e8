// SPDX-License-Identifier: Apache-2.0
// What the stages of reuse share: light points and target values by light index.
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

// p_hat of the point (u, v) of a light at a surface; 0 for no light.
float reuse_target_of(TargetSurface s, uint light, float u, float v) {
  if (light >= HW_ROOT.light_count) return 0.0;
  LightRecord record = LightTable(HW_ROOT.lights).at[light];
  float choice = AliasTable(HW_ROOT.light_alias).at[light].pdf;
  LightPoint p = light_point(record, HW_ROOT.world, vec2(u, v), s.position);
  uint flags = record.type == HW_LIGHT_WORLD ? HW_ROOT.world_flags : record.flags;
  float value = target_value(s, p, flags, choice, HW_REUSE.light_mis_scale);
  return choice > 0.0 ? value : 0.0;
}
#endif
