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
  RecordArray records = RecordArray(HW_REUSE.records);
  uint tag = 1u;
#ifndef HW_CELLS_TREE
  tag = grid_tag(HW_REUSE.grid, grid_at(HW_REUSE.grid, i / HW_REUSE.cell_slots));
#endif
  bool keeps = push.b < 2u && records.at[i].tag == tag;
  if (push.b == 0u && keeps) {
    reservoir_store(record_address(i), 0u, reservoir_next_frame(record_sample(i)));
  } else {
    reservoir_store(record_address(i), 0u, reservoir_empty(0.0));
    records.at[i].surface.key = HW_NONE;
  }
  if (!keeps) records.at[i].pass = HW_REUSE.pass;
  records.at[i].tag = tag;
  // A pass that was cancelled may have left a race.
  RecordRace race;
  race.best = HW_NONE;
  race.worst = 0u;
  race.offered = 0u;
  race.load = keeps ? RaceArray(HW_REUSE.races).at[i].load : 0u;
  RaceArray(HW_REUSE.races).at[i] = race;
}
