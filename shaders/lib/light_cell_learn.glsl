// SPDX-License-Identifier: Apache-2.0
// A light sample that arrived teaches the cell that proposed it.
#ifndef HW_LIGHT_CELL_LEARN_GLSL
#define HW_LIGHT_CELL_LEARN_GLSL
#include "light_cells.glsl"
#include "light_proxy.h"
#include "reservoir_race.h"

// A sample counts as at most this many times what the cell is used to: one that was very unlikely says little.
const float HW_LIGHT_CELL_SURPRISE = 64.0;

void light_cell_learn(uint cell, ShadowState shadow) {
  if (cell == HW_NONE) return;
  float light = luminance(max(shadow.radiance, vec3(0.0))) * shadow.teaches;
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  float mean = uintBitsToFloat(light_cell_uint(cell, HW_LIGHT_CELL_UINT_MEAN));
  if (mean > 0.0) light = min(light, HW_LIGHT_CELL_SURPRISE * mean);
  uint place = uint_at(HW_ROOT.light_position, shadow.light);
  uvec2 links = light_tree_links(HW_ROOT.light_tree, light_cell_uint(cell, HW_LIGHT_CELL_UINT_NODE + shadow.slot));
  bool right = links.x != HW_NONE && place >= links.y;
  uint64_t units = fixed_from_float(light, cells.at[cell].exponent);
  if (right) {
    atomicAdd(cells.at[cell].sum_right[shadow.slot], units);
  } else {
    atomicAdd(cells.at[cell].sum_left[shadow.slot], units);
  }
}
#endif
