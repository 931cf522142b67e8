// SPDX-License-Identifier: Apache-2.0
// Makes the proxies of all lights. a: how many, c: the first.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_proxy.h"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = push.c + gl_GlobalInvocationID.x;
  if (i >= push.a) return;
  bool constant_world = HW_ROOT.world_material == HW_NONE;
  float world = constant_world ? luminance(HW_ROOT.world_color) : HW_ROOT.world.total;
  LightProxyArray(HW_FRAME.reuse.proxies).at[i] =
      light_proxy(light_load(i), AliasTable(HW_ROOT.light_alias).at[i], world, HW_ROOT.world_flags);
}
