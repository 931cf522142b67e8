// SPDX-License-Identifier: Apache-2.0
// After a pass: every bucket takes in the cell it was asked for, in a free place or in that of the cell that was not
// looked up for longest, if that is long. One thread a bucket. a: how many, c: the first.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/light_cell_cut.glsl"
layout(local_size_x = 64) in;

void main() {
  uint bucket = push.c + gl_GlobalInvocationID.x;
  if (bucket >= push.a) return;
  LightCellRequestArray requests = LightCellRequestArray(HW_CELLS.requests);
  LightCellRequest asked = requests.at[bucket];
  if (asked.tag == HW_NONE) return;
  requests.at[bucket].tag = HW_NONE;
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  UintBuffer tags = UintBuffer(HW_CELLS.tags);
  uint place = HW_NONE;
  uint longest = HW_CELLS.keep;
  for (uint way = 0u; way < HW_LIGHT_CELL_WAYS; ++way) {
    uint cell = bucket * HW_LIGHT_CELL_WAYS + way;
    uint unused = tags.at[cell] == 0u ? HW_NONE : HW_CELLS.pass - cells.at[cell].used;
    if (unused > longest) longest = unused, place = cell;
  }
  if (place == HW_NONE) return;
  tags.at[place] = asked.tag;
  cells.at[place].used = HW_CELLS.pass;
  light_cell_forget_pass(cells, place);
  cells.at[place].evidence = 0.0;
  cells.at[place].mean = 0.0;
  cells.at[place].center = asked.center;
  uint slots = light_cell_begin(cells, place);
  cells.at[place].slots = slots;
  light_cell_weigh(cells, place, slots, 0.0, 0.0, 0.0);
  cells.at[place].exponent = light_cell_scale(cells, place, slots);
}
