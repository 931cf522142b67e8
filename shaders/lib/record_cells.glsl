// SPDX-License-Identifier: Apache-2.0
// Cells of unbiased world-space estimators: leaves of a k-d tree that follows the scene (with HW_CELLS_TREE) or cells of
// the grid, each with cell_slots records (ReuseRecord). A record keeps the surface it was made for, so that whoever
// reads it knows its p_hat: no cell target, no 1/M.
#ifndef HW_RECORD_CELLS_GLSL
#define HW_RECORD_CELLS_GLSL
#include "cell_place.glsl"
#include "following_tree.h"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer RecordCellArray { RecordCell at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer WitnessArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer SurveyArray { LeafSurvey at[]; };

uint64_t record_address(uint cell) { return HW_REUSE.records + uint64_t(cell) * HW_REUSE_RECORD_BYTES; }
Reservoir record_sample(uint cell) { return reservoir_load(record_address(cell), 0u); }
ReuseSurface record_surface(uint cell) {
  return reuse_surface_load(record_address(cell) + HW_REUSE_RECORD_SURFACE, 0u);
}
// Whether a cell has a record that may be read: not older than record_age passes, lest one stays for ever where paths
// hardly come, and its noise with it.
bool record_is_fresh(uint cell) {
  uint made = RecordCellArray(HW_REUSE.record_cells).at[cell].made;
  return made != 0u && HW_REUSE.pass + 1u - made <= HW_REUSE.record_age;
}

// Decides whose record a cell keeps. A bijection of what tells the pass's paths apart, so that no two are alike.
uint record_key(PathState state) {
  return sampler_hash(cell_sample_id(state) ^ sampler_hash(HW_REUSE.pass ^ sampler_hash(HW_FRAME.seed ^ 0x7f4a7c15u)));
}

// The cell P (world space) lies in; HW_NONE: outside of all.
uint record_cell(vec3 P) {
#ifdef HW_CELLS_TREE
  return leaf_reservoir(following_leaf(HW_REUSE.leaves, P).link, P);
#else
  return grid_reservoir_of(P);
#endif
}

// Where a surface looks for records.
struct RecordPlace {
  uint own;  // the surface's cell
#ifdef HW_CELLS_TREE
  uint rank;  // of the leaf
  FollowingNode subtree;
#else
  ivec3 cell;
#endif
};

RecordPlace record_place(vec3 P) {
  RecordPlace place;
  place.own = record_cell(P);
#ifdef HW_CELLS_TREE
  place.rank = following_leaf(HW_REUSE.leaves, P).first;
  place.subtree = following_above(HW_REUSE.leaves, P, HW_REUSE.ascension);
#else
  place.cell = grid_project(HW_REUSE.grid, P);
#endif
  return place;
}

// Draw i of k among the cells about the own one, which is never drawn; HW_NONE: there is none.
uint record_neighbour(RecordPlace place, uint i, uint k, float u, inout uint random) {
#ifdef HW_CELLS_TREE
  uint other = following_neighbour_of(HW_REUSE.leaves, place.subtree, place.rank, i, k, u);
#else
  vec3 u3 = vec3(random_next(random), random_next(random), random_next(random));
  ivec3 there = grid_neighbour(HW_REUSE.grid, place.cell, HW_REUSE.grid_radius, u3);
  uint other = there.x == HW_GRID_NONE ? HW_NONE : grid_index(HW_REUSE.grid, there);
#endif
  uint slot = min(uint(random_next(random) * float(HW_REUSE.cell_slots)), HW_REUSE.cell_slots - 1u);
  return other == HW_NONE ? HW_NONE : other * HW_REUSE.cell_slots + slot;
}
#endif
