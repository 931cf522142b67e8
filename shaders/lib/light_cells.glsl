// SPDX-License-Identifier: Apache-2.0
// The cells of `wssr-hash` in memory (shared/light_cells.h): drawing lights by a cell's learned distribution with
// the exact probability, and that probability for a light found otherwise.
#ifndef HW_LIGHT_CELLS_GLSL
#define HW_LIGHT_CELLS_GLSL
#include "wave.glsl"
#include "light_tree.glsl"

#define HW_CELLS HW_FRAME.light_cells
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer LightCellArray { LightCell at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer LightCellRequestArray { LightCellRequest at[]; };

// A cell has been asked and taught nothing since the last update.
void light_cell_forget_pass(LightCellArray cells, uint cell) {
  cells.at[cell].samples = 0u;
  for (uint k = 0u; k < HW_LIGHT_CELL_SLOTS; ++k) {
    cells.at[cell].sum_left[k] = uint64_t(0u);
    cells.at[cell].sum_right[k] = uint64_t(0u);
    cells.at[cell].sum_expected[k] = uint64_t(0u);
  }
}

// Number `i` of a cell as the last update left it.
uint light_cell_uint(uint cell, uint i) { return uint_at(HW_CELLS.cells + uint64_t(cell) * HW_LIGHT_CELL_BYTES, i); }

// The slot that holds the light at a place of the tree's order.
uint light_cell_slot_of(uint cell, uint slots, uint place) {
  uint low = 0u;
  for (uint step = HW_LIGHT_CELL_SLOTS / 2u; step > 0u; step /= 2u) {
    uint next = low + step;
    if (next < slots && light_cell_uint(cell, HW_LIGHT_CELL_UINT_FIRST + next) <= place) low = next;
  }
  return low;
}

// Light to be expected from a slot; 0 from one that is not there.
float light_cell_expected(uint cell, uint slot, LightTreeReceiver r) {
  uint64_t w = HW_CELLS.cells + uint64_t(cell) * HW_LIGHT_CELL_BYTES;
  LightTreeBounds bounds = light_tree_bounds_of(word_at(w, 2u * slot), word_at(w, 2u * slot + 1u));
  float expected = light_tree_importance(bounds, r, HW_ROOT.light_tree_scale);
  return light_tree_power(bounds) > 0.0 ? expected : 0.0;
}

// The probability with which surfaces of `cell` choose `light` (lib/light_cell_draw.glsl); without a cell, the
// tree's.
float light_cell_pdf(uint cell, uint light, vec3 P, vec3 N, bool transmits) {
  if (cell == HW_NONE) return light_tree_pdf(0u, light, P, N, transmits);
  uint place = uint_at(HW_ROOT.light_position, light);
  if (place == HW_NONE) return 0.0;
  LightTreeReceiver receiver = LightTreeReceiver(P, N, transmits);
  uint slots = light_cell_uint(cell, HW_LIGHT_CELL_UINT_SLOTS);
  uint slot = light_cell_slot_of(cell, slots, place);
  float all = 0.0, own = 0.0;
  for (uint k = 0u; k < slots; ++k) {
    float expected = light_cell_expected(cell, k, receiver);
    all += expected;
    if (k == slot) own = expected;
  }
  return own > 0.0 ? own / all * light_tree_pdf(light_cell_uint(cell, HW_LIGHT_CELL_UINT_NODE + slot), light, P, N, transmits) : 0.0;
}
#endif
