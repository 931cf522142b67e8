// SPDX-License-Identifier: Apache-2.0
// What cells of reservoirs (lib/reuse_cells.glsl) and cells of records (lib/record_cells.glsl) have in common: where in the
// grid or in a leaf a point lies, and which path of a pass a sample comes from.
#ifndef HW_CELL_PLACE_GLSL
#define HW_CELL_PLACE_GLSL
#include "reuse.glsl"
#include "world_grid.h"

// A reservoir of a leaf. It has no extent of its own to divide: slots are told apart by where P lies in a small lattice.
uint leaf_reservoir(uint leaf, vec3 P) {
  uint slot = sampler_hash_combine(sampler_hash(floatBitsToUint(P.x) >> 12u),
                                   (floatBitsToUint(P.y) >> 12u) ^ (floatBitsToUint(P.z) >> 13u)) % HW_REUSE.cell_slots;
  return leaf * HW_REUSE.cell_slots + slot;
}

// The grid's reservoir for P (world space); HW_NONE: P lies outside and is not projected.
uint grid_reservoir_of(vec3 P) {
  ivec3 cell;
  bool inside = grid_cell(HW_REUSE.grid, P, cell);
  bool taken = inside || reuse_has(HW_REUSE_REPROJECT);  // grid_cell leaves the nearest one where P is outside
  return taken ? grid_reservoir(HW_REUSE.grid, cell, P) : HW_NONE;
}

// Tells the samples of a pass apart: by pixel and how far along the path.
uint cell_sample_id(PathState state) {
  return state.pixel ^ ((path_bounce(state.bounces) + state.transparent) << 25u);
}
#endif
