// SPDX-License-Identifier: Apache-2.0
// Before a frame: cells that the grid's window has moved over are emptied, the samples of the others follow their
// lights. One thread a reservoir. a: how many, c: the first, b: 1: nothing is kept.
// variant cell_begin_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/reuse_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = push.c + gl_GlobalInvocationID.x;
  if (i >= push.a) return;
  CellArray cells = CellArray(HW_REUSE.cells);
  uint tag = 1u;
#ifndef HW_CELLS_TREE
  tag = grid_tag(HW_REUSE.grid, grid_at(HW_REUSE.grid, i / HW_REUSE.cell_slots));
#endif
  bool keeps = push.b == 0u && cells.at[i].tag == tag;
  ReuseCell now;
  now.sum = uint64_t(0u);
  now.best = race_none();
  now.held = reservoir_empty(0.0);
  if (keeps) now.held = reservoir_next_frame(cell_held(i));
  now.tag = tag;
  now.inputs = keeps ? cells.at[i].inputs : 0u;
  // A pass that was cancelled may have left samples.
  now.count = 0u;
  now.offered = 0u;
  now.light = HW_NONE;
  now.u = 0.0;
  now.v = 0.0;
  now.target = 0.0;
  cells.at[i] = now;
}
