// SPDX-License-Identifier: Apache-2.0
// Before a frame: cells that the grid's window has moved over are emptied, the samples of the others follow their
// lights. One thread a cell. a: how many, c: the first; b: 0: all is kept, 1: the tree and what its leaves saw, but no
// sample, 2: nothing.
// variant record_begin_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/record_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = push.c + gl_GlobalInvocationID.x;
  if (i >= push.a) return;
  RecordCellArray cells = RecordCellArray(HW_REUSE.record_cells);
  uint tag = 1u;
#ifndef HW_CELLS_TREE
  tag = grid_tag(HW_REUSE.grid, grid_at(HW_REUSE.grid, i / HW_REUSE.cell_slots));
#endif
  RecordCell cell = cells.at[i];
  bool keeps = push.b < 2u && cell.tag == tag;
  cell.made = keeps && push.b == 0u ? cell.made : 0u;
  cell.seen = keeps ? cell.seen : HW_REUSE.pass;
  cell.load = keeps ? cell.load : 0u;
  cell.tag = tag;
  // A pass that was cancelled may have left a race.
  cell.best = HW_NONE;
  cell.worst = 0u;
  cell.offered = 0u;
  cells.at[i] = cell;
  if (cell.made != 0u) reservoir_store(record_address(i), 0u, reservoir_next_frame(record_sample(i)));
}
