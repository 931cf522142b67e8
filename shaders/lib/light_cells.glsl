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
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer LightChoiceArray { LightChoice at[]; };

// A cell has been asked and taught nothing since the last update.
void light_cell_forget_pass(LightCellArray cells, uint cell) {
  cells.at[cell].samples = 0u;
  for (uint k = 0u; k < HW_LIGHT_CELL_SLOTS; ++k) {
    cells.at[cell].sum_left[k] = uint64_t(0u);
    cells.at[cell].sum_right[k] = uint64_t(0u);
    cells.at[cell].sum_expected[k] = uint64_t(0u);
  }
}

// The choice of light sample `number` of a path's surface; surfaces that get one have it as number 0.
LightChoice light_choice_load(uint path, uint number) {
  return LightChoiceArray(HW_CELLS.chosen).at[path * HW_FRAME.light_samples + number];
}

// The slot that holds the light at a place of the tree's order.
uint light_cell_slot_of(LightCellArray cells, uint cell, uint slots, uint place) {
  uint low = 0u;
  for (uint step = HW_LIGHT_CELL_SLOTS / 2u; step > 0u; step /= 2u) {
    uint next = low + step;
    if (next < slots && cells.at[cell].first[next] <= place) low = next;
  }
  return low;
}

// A slot of a cell as the node of the tree that it is, by words: the order is LightCellSlot's. `index`: the node's.
LightTreeNode light_cell_slot(uint cell, uint slot, out uint index) {
  Words w = Words(HW_CELLS.cells + uint64_t(cell) * HW_LIGHT_CELL_BYTES + HW_LIGHT_CELL_FIRST_SLOT +
                  uint64_t(slot * HW_LIGHT_CELL_SLOT_BYTES));
  uint64_t w3 = w.at[3], w4 = w.at[4];
  LightTreeNode n;
  words_to_vectors(w.at[0], w.at[1], w.at[2], n.low, n.high);
  n.axis = word_low(w3);
  n.cone = word_high(w3);
  n.power = word_low_float(w4);
  n.first = 0u;
  n.count = 0u;
  n.child = 0u;
  index = word_high(w4);
  return n;
}

// Light to be expected from a slot.
float light_cell_expected(uint cell, uint slot, LightTreeReceiver r, out uint node) {
  return light_tree_importance(light_cell_slot(cell, slot, node), r);
}

// The probability with which surfaces of `cell` choose `light` (stages/light_cell_choose.comp); without a cell, the
// tree's.
float light_cell_pdf(uint cell, uint light, vec3 P, vec3 N, bool transmits) {
  if (cell == HW_NONE) return light_tree_pdf(0u, light, P, N, transmits);
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  LightTreeReceiver receiver = LightTreeReceiver(P, N, transmits);
  uint slots = cells.at[cell].slots;
  uint slot = light_cell_slot_of(cells, cell, slots, UintArray(HW_ROOT.light_position).at[light]);
  float all = 0.0, own = 0.0;
  uint node, within = 0u;
  for (uint k = 0u; k < slots; ++k) {
    float expected = light_cell_expected(cell, k, receiver, node);
    all += expected;
    if (k == slot) own = expected, within = node;
  }
  return own > 0.0 ? own / all * light_tree_pdf(within, light, P, N, transmits) : 0.0;
}
#endif
