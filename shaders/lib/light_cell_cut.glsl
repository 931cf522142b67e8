// SPDX-License-Identifier: Apache-2.0
// The cut of a cell through the light tree: split where the light comes from, merged where none does, and what each of
// its nodes gives. Follows the idea of cuts that learn (Pantaleoni 2019, "Importance Sampling of Many Lights with
// Reinforcement Lightcuts Learning"), with sums in place of a temporal-difference rule.
#ifndef HW_LIGHT_CELL_CUT_GLSL
#define HW_LIGHT_CELL_CUT_GLSL
#include "light_cells.glsl"
#include "reservoir_race.h"

const float HW_LIGHT_CELL_DOUBT = 4.0;  // light samples that count as much as the mean of the cell

uvec2 light_cell_links(LightCellArray cells, uint cell, uint slot) {
  return light_tree_links(HW_ROOT.light_tree, cells.at[cell].node[slot]);
}

bool light_cell_can_split(LightCellArray cells, uint cell, uint slot) {
  return light_cell_links(cells, cell, slot).x != HW_NONE;
}

// The importance of a node for the cell's middle, from whatever side light comes.
float light_cell_importance(LightCellArray cells, uint cell, uint node) {
  return light_tree_importance(light_tree_bounds(HW_ROOT.light_tree, node),
                               LightTreeReceiver(cells.at[cell].center, vec3(0.0, 0.0, 1.0), true),
                               HW_ROOT.light_tree_scale);
}

// What is learned of slot `from` also becomes what is learned of slot `to`.
void light_cell_copy(LightCellArray cells, uint cell, uint to, uint from) {
  cells.at[cell].node[to] = cells.at[cell].node[from];
  cells.at[cell].first[to] = cells.at[cell].first[from];
  cells.at[cell].response[to] = cells.at[cell].response[from];
  cells.at[cell].left[to] = cells.at[cell].left[from];
  cells.at[cell].right[to] = cells.at[cell].right[from];
  cells.at[cell].asked[to] = cells.at[cell].asked[from];
}

// Puts a slot's two children in its place. The light of its halves is known; the importance asked of each is what it
// would be at the cell's middle.
void light_cell_split(LightCellArray cells, uint cell, uint slots, uint slot) {
  for (uint k = slots; k > slot + 1u; --k) light_cell_copy(cells, cell, k, k - 1u);
  uvec2 links = light_cell_links(cells, cell, slot);
  uint child = links.x;
  float left = light_cell_importance(cells, cell, child), right = light_cell_importance(cells, cell, child + 1u);
  float both = left + right;
  float share = both > 0.0 ? clamp(left / both, 0.01, 0.99) : 0.5;
  light_cell_copy(cells, cell, slot + 1u, slot);
  cells.at[cell].node[slot] = child;
  cells.at[cell].node[slot + 1u] = child + 1u;
  cells.at[cell].first[slot + 1u] = links.y;
  cells.at[cell].left[slot] *= 0.5;
  cells.at[cell].right[slot] = cells.at[cell].left[slot];
  cells.at[cell].asked[slot] *= share;
  cells.at[cell].right[slot + 1u] *= 0.5;
  cells.at[cell].left[slot + 1u] = cells.at[cell].right[slot + 1u];
  cells.at[cell].asked[slot + 1u] *= 1.0 - share;
}

// The node whose children two neighbours of the cut are; HW_NONE: they have no parent in common. `place`: of a light.
uint light_cell_parent(uint left, uint right, uint place) {
  if (right != left + 1u) return HW_NONE;
  uint node = 0u;
  for (uint level = 0u; level < 64u; ++level) {
    uvec2 links = light_tree_links(HW_ROOT.light_tree, node);
    if (links.x == HW_NONE) return HW_NONE;
    if (links.x == left) return node;
    if (links.x == right) return HW_NONE;
    node = place < links.y ? links.x : links.x + 1u;
  }
  return HW_NONE;
}

void light_cell_merge(LightCellArray cells, uint cell, uint slots, uint slot, uint parent) {
  cells.at[cell].node[slot] = parent;
  cells.at[cell].left[slot] += cells.at[cell].right[slot];
  cells.at[cell].right[slot] = cells.at[cell].left[slot + 1u] + cells.at[cell].right[slot + 1u];
  cells.at[cell].asked[slot] += cells.at[cell].asked[slot + 1u];
  for (uint k = slot + 1u; k + 1u < slots; ++k) light_cell_copy(cells, cell, k, k + 1u);
}

// A cut for a cell that knows nothing yet: the tree's, split where most is to be expected from.
uint light_cell_begin(LightCellArray cells, uint cell) {
  uint slots = 1u;
  cells.at[cell].node[0] = 0u;
  cells.at[cell].first[0] = 0u;
  cells.at[cell].response[0] = 1.0;  // while the cut is made, of a slot: what is expected
  cells.at[cell].left[0] = 0.0;
  cells.at[cell].right[0] = 0.0;
  cells.at[cell].asked[0] = 0.0;
  while (slots < HW_LIGHT_CELL_SLOTS / 2u) {
    uint best = HW_NONE;
    float most = 0.0;
    for (uint k = 0u; k < slots; ++k) {
      float expected = cells.at[cell].response[k];
      if (expected > most && light_cell_can_split(cells, cell, k)) most = expected, best = k;
    }
    if (best == HW_NONE) break;
    light_cell_split(cells, cell, slots, best);
    slots += 1u;
    for (uint k = best; k < best + 2u; ++k)
      cells.at[cell].response[k] = light_cell_importance(cells, cell, cells.at[cell].node[k]);
  }
  return slots;
}

// Fills in the slots' nodes, and what arrives of their power: by what was learned, drawn towards the cell's mean where
// little is known, and never below `floor` of it. `total`: light in all; `asked`: importance in all.
void light_cell_weigh(LightCellArray cells, uint cell, uint slots, float floor, float total, float asked) {
  float evidence = cells.at[cell].evidence;
  float mean = total > 0.0 && asked > 0.0 ? total / asked : HW_CELLS.unit;
  float doubt = evidence > 0.0 ? HW_LIGHT_CELL_DOUBT * asked / evidence : 1.0;
  for (uint k = 0u; k < slots; ++k) {
    LightTreeBounds bounds = light_tree_bounds(HW_ROOT.light_tree, cells.at[cell].node[k]);
    float light = cells.at[cell].left[k] + cells.at[cell].right[k];
    float response = (light + doubt * mean) / (cells.at[cell].asked[k] + doubt);
    response = response > floor * mean ? response : floor * mean;  // of two zeros too
    // As the slot can hold it, so that what is asked of the node is counted exactly.
    float power = light_tree_power(bounds);
    bounds = light_tree_with_power(bounds, clamp(power * response, 1e-30, 1e30));
    cells.at[cell].response[k] = light_tree_power(bounds) / power;
    cells.at[cell].slot[k] = bounds;
  }
  for (uint k = slots; k < HW_LIGHT_CELL_SLOTS; ++k) cells.at[cell].slot[k] = LightTreeBounds(0u, 0u, 0u, 0u);
}

// The exponent of a cell's sums by what is to be expected at its middle.
int light_cell_scale(LightCellArray cells, uint cell, uint slots) {
  float expected = 0.0;
  for (uint k = 0u; k < slots; ++k)
    expected += light_cell_importance(cells, cell, cells.at[cell].node[k]) * cells.at[cell].response[k];
  return fixed_exponent(expected);
}
#endif
