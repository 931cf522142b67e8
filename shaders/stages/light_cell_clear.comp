// SPDX-License-Identifier: Apache-2.0
// Before a frame: cells whose tree is another now forget everything (b: 1); the others drop what a cancelled pass left.
// One thread a bucket. a: how many, c: the first.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/light_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  uint bucket = push.c + gl_GlobalInvocationID.x;
  if (bucket >= push.a) return;
  LightCellRequestArray(HW_CELLS.requests).at[bucket].tag = HW_NONE;
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  UintBuffer tags = UintBuffer(HW_CELLS.tags);
  for (uint way = 0u; way < HW_LIGHT_CELL_WAYS; ++way) {
    uint cell = bucket * HW_LIGHT_CELL_WAYS + way;
    if (push.b == 1u) tags.at[cell] = 0u;
    if (tags.at[cell] == 0u || cells.at[cell].samples == 0u) continue;
    light_cell_forget_pass(cells, cell);
  }
}
