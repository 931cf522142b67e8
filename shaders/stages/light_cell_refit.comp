// SPDX-License-Identifier: Apache-2.0
// Before a frame whose lights are not where they were: cells keep what they have learned, and take the bounds and power of
// their cuts' nodes anew. With old ones a surface could hold a light that now shines on it for one that can't.
// One thread a cell. a: how many, c: the first; b: as a float, the old unit of importance over the new one.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/light_cell_cut.glsl"
layout(local_size_x = 64) in;

void main() {
  uint cell = push.c + gl_GlobalInvocationID.x;
  if (cell >= push.a || UintBuffer(HW_CELLS.tags).at[cell] == 0u) return;
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  uint slots = cells.at[cell].slots;
  float total = 0.0, asked = 0.0;
  for (uint k = 0u; k < slots; ++k) {
    total += cells.at[cell].left[k] + cells.at[cell].right[k];
    cells.at[cell].asked[k] *= uintBitsToFloat(push.b);
    asked += cells.at[cell].asked[k];
  }
  light_cell_weigh(cells, cell, slots, HW_CELLS.floor, total, asked);
  cells.at[cell].exponent = light_cell_scale(cells, cell, slots);
}
