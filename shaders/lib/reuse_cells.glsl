// SPDX-License-Identifier: Apache-2.0
// Cells of world-space reservoirs: the leaves of the k-d tree (with HW_CELLS_TREE) or the cells of the grid, each with
// cell_slots reservoirs. Which cell a surface lies in, which are its neighbours.
#ifndef HW_REUSE_CELLS_GLSL
#define HW_REUSE_CELLS_GLSL
#include "cell_place.glsl"
#include "kd_tree.h"
#include "reservoir_race.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CellArray { ReuseCell at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer KeyArray { uint64_t at[]; };

// What a cell holds: from the third word of ReuseCell.
Reservoir cell_held(uint cell) {
  return reservoir_load(HW_REUSE.cells + uint64_t(cell) * HW_REUSE_CELL_BYTES + HW_REUSE_CELL_HELD, 0u);
}

// The reservoir of P's own cell; HW_NONE: P lies outside of all cells.
uint cell_of(vec3 P) {
#ifdef HW_CELLS_TREE
  return leaf_reservoir(kd_leaf(HW_REUSE.tree, P), P);
#else
  return grid_reservoir_of(P);
#endif
}

// Neighbour i of k of P's cell, and one of its reservoirs; HW_NONE: none.
uint cell_neighbour(vec3 P, uint i, uint k, float u, inout uint random) {
#ifdef HW_CELLS_TREE
  uint other = kd_neighbour_of(HW_REUSE.tree, kd_leaf(HW_REUSE.tree, P), HW_REUSE.ascension, i, k, u);
#else
  ivec3 cell = grid_project(HW_REUSE.grid, P);
  vec3 u3 = vec3(random_next(random), random_next(random), random_next(random));
  ivec3 there = grid_neighbour(HW_REUSE.grid, cell, HW_REUSE.grid_radius, u3);
  uint other = there.x == HW_GRID_NONE ? HW_NONE : grid_index(HW_REUSE.grid, there);
#endif
  uint slot = min(uint(random_next(random) * float(HW_REUSE.cell_slots)), HW_REUSE.cell_slots - 1u);
  return other == HW_NONE ? HW_NONE : other * HW_REUSE.cell_slots + slot;
}
#endif
