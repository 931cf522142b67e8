// SPDX-License-Identifier: Apache-2.0
// Makes the leaves that `wssr-hash` chooses among: of all lights that the tree holds. a: how many lights, c: the first.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_leaf.h"
#include "lib/light_proxy.h"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer LightLeafArray { LightLeaf at[]; };

void main() {
  uint light = push.c + gl_GlobalInvocationID.x;
  if (light >= push.a) return;
  uint place = UintArray(HW_ROOT.light_position).at[light];
  if (place == HW_NONE) return;
  bool constant_world = HW_ROOT.world_material == HW_NONE;
  float world = constant_world ? luminance(HW_ROOT.world_color) : HW_ROOT.world.total;
  LightProxy proxy = light_proxy(light_load(light), AliasTable(HW_ROOT.light_alias).at[light], world, HW_ROOT.world_flags);
  LightLeafArray(HW_FRAME.light_cells.leaves).at[place] = light_leaf_pack(proxy, light);
}
