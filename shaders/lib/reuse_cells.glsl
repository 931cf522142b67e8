// SPDX-License-Identifier: Apache-2.0
// Cells of world-space reservoirs: the leaves of the k-d tree (with HW_CELLS_TREE) or the cells of the grid, each with
// cell_slots reservoirs. Which cell a surface lies in, which are its neighbours.
#ifndef HW_REUSE_CELLS_GLSL
#define HW_REUSE_CELLS_GLSL
#include "reuse.glsl"
#include "kd_tree.h"
#include "reservoir_race.h"
#include "world_grid.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CellArray { ReuseCell at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer KeyArray { uint64_t at[]; };

// What a cell holds: from the third word of ReuseCell.
Reservoir cell_held(uint cell) {
  return reservoir_load(HW_REUSE.cells + uint64_t(cell) * HW_REUSE_CELL_BYTES + HW_REUSE_CELL_HELD, 0u);
}

// The reservoir of P's own cell; HW_NONE: P lies outside of all cells.
uint cell_of(vec3 P) {
#ifdef HW_CELLS_TREE
  uint leaf = kd_leaf(HW_REUSE.tree, P);
  // A leaf has no extent of its own to divide: its slots are told apart by where P lies in a small lattice.
  uint slot = sampler_hash_combine(sampler_hash(floatBitsToUint(P.x) >> 12u),
                                   (floatBitsToUint(P.y) >> 12u) ^ (floatBitsToUint(P.z) >> 13u)) % HW_REUSE.cell_slots;
  return leaf * HW_REUSE.cell_slots + slot;
#else
  ivec3 cell;
  bool inside = grid_cell(HW_REUSE.grid, P, cell);
  bool taken = inside || reuse_has(HW_REUSE_REPROJECT);  // grid_cell leaves the nearest one where P is outside
  return taken ? grid_reservoir(HW_REUSE.grid, cell, P) : HW_NONE;
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

// Tells the samples of a pass apart: by pixel and how far along the path.
uint cell_sample_id(PathState state) {
  return state.pixel ^ ((path_bounce(state.bounces) + state.transparent) << 25u);
}
#endif
