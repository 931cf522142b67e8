// SPDX-License-Identifier: Apache-2.0
// Before a frame: the samples of the picture's reservoirs follow their lights. One thread a pixel. a: how many,
// c: the first.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/reuse.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = push.c + gl_GlobalInvocationID.x;
  if (i >= push.a) return;
  reservoir_store(HW_REUSE.screen, i, reservoir_next_frame(reservoir_load(HW_REUSE.screen, i)));
}
