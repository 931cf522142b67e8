// SPDX-License-Identifier: Apache-2.0
// The cut of a cell through the light tree: split where the light comes from, merged where none does, and what each of
// its nodes gives. Follows the idea of cuts that learn (Pantaleoni 2019, "Importance Sampling of Many Lights with
// Reinforcement Lightcuts Learning"), with sums in place of a temporal-difference rule.
#ifndef HW_LIGHT_CELL_CUT_GLSL
#define HW_LIGHT_CELL_CUT_GLSL
#include "light_cells.glsl"

const float HW_LIGHT_CELL_DOUBT = 4.0;  // light samples that count as much as the mean of the cell

LightTreeNode light_cell_node(LightCellArray cells, uint cell, uint slot) {
  return light_tree_load(HW_ROOT.light_tree, cells.at[cell].slot[slot].node);
}

bool light_cell_can_split(LightCellArray cells, uint cell, uint slot) {
  return light_cell_node(cells, cell, slot).child != HW_NONE;
}

// The importance of a node for the cell's middle, from whatever side light comes.
float light_cell_importance(LightCellArray cells, uint cell, uint node) {
  return light_tree_importance(light_tree_load(HW_ROOT.light_tree, node),
                               LightTreeReceiver(cells.at[cell].center, vec3(0.0, 0.0, 1.0), true));
}

// What is learned of slot `from` also becomes what is learned of slot `to`.
void light_cell_copy(LightCellArray cells, uint cell, uint to, uint from) {
  cells.at[cell].slot[to].node = cells.at[cell].slot[from].node;
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
  uint child = light_cell_node(cells, cell, slot).child;
  float left = light_cell_importance(cells, cell, child), right = light_cell_importance(cells, cell, child + 1u);
  float both = left + right;
  float share = both > 0.0 ? clamp(left / both, 0.01, 0.99) : 0.5;
  light_cell_copy(cells, cell, slot + 1u, slot);
  cells.at[cell].slot[slot].node = child;
  cells.at[cell].slot[slot + 1u].node = child + 1u;
  cells.at[cell].first[slot + 1u] = light_tree_load(HW_ROOT.light_tree, child + 1u).first;
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
    uint child = light_tree_load(HW_ROOT.light_tree, node).child;
    if (child == HW_NONE) return HW_NONE;
    if (child == left) return node;
    if (child == right) return HW_NONE;
    node = place < light_tree_load(HW_ROOT.light_tree, child + 1u).first ? child : child + 1u;
  }
  return HW_NONE;
}

void light_cell_merge(LightCellArray cells, uint cell, uint slots, uint slot, uint parent) {
  cells.at[cell].slot[slot].node = parent;
  cells.at[cell].left[slot] += cells.at[cell].right[slot];
  cells.at[cell].right[slot] = cells.at[cell].left[slot + 1u] + cells.at[cell].right[slot + 1u];
  cells.at[cell].asked[slot] += cells.at[cell].asked[slot + 1u];
  for (uint k = slot + 1u; k + 1u < slots; ++k) light_cell_copy(cells, cell, k, k + 1u);
}

// A cut for a cell that knows nothing yet: the tree's, split where most is to be expected from.
uint light_cell_begin(LightCellArray cells, uint cell) {
  uint slots = 1u;
  cells.at[cell].slot[0].node = 0u;
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
      cells.at[cell].response[k] = light_cell_importance(cells, cell, cells.at[cell].slot[k].node);
  }
  return slots;
}

// Fills in the slots' nodes, and what arrives of their power: by what was learned, drawn towards the cell's mean where
// little is known, and never below `floor` of it. `total`: light in all; `asked`: importance in all.
void light_cell_weigh(LightCellArray cells, uint cell, uint slots, float floor, float total, float asked) {
  float evidence = cells.at[cell].evidence;
  float mean = total > 0.0 && asked > 0.0 ? total / asked : 1.0;
  float doubt = evidence > 0.0 ? HW_LIGHT_CELL_DOUBT * asked / evidence : 1.0;
  for (uint k = 0u; k < slots; ++k) {
    LightTreeNode node = light_cell_node(cells, cell, k);
    float light = cells.at[cell].left[k] + cells.at[cell].right[k];
    float response = max((light + doubt * mean) / (cells.at[cell].asked[k] + doubt), floor * mean);
    cells.at[cell].response[k] = response;
    cells.at[cell].slot[k].low = node.low;
    cells.at[cell].slot[k].high = node.high;
    cells.at[cell].slot[k].axis = node.axis;
    cells.at[cell].slot[k].cone = node.cone;
    cells.at[cell].slot[k].power = node.power * response;
  }
}
#endif
