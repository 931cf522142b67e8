// SPDX-License-Identifier: Apache-2.0
// After a pass: cells take in what they were taught, their cuts follow the light, their probabilities are made anew.
// One thread a cell. a: how many, c: the first.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/light_cell_cut.glsl"
#include "lib/reservoir_race.h"
layout(local_size_x = 64) in;

const float HW_LIGHT_CELL_MEMORY = 65536.0;  // light samples' worth of knowledge, so that cells follow moving lights
const uint HW_LIGHT_CELL_CHANGES = 4u;       // splits a pass: more than that is guessed, not learned

void main() {
  uint cell = push.c + gl_GlobalInvocationID.x;
  if (cell >= push.a || UintBuffer(HW_CELLS.tags).at[cell] == 0u) return;
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  uint samples = cells.at[cell].samples;
  if (samples == 0u) return;
  cells.at[cell].samples = 0u;
  uint slots = cells.at[cell].slots;

  float evidence = cells.at[cell].evidence + float(samples);
  float kept = min(1.0, HW_LIGHT_CELL_MEMORY / evidence);
  evidence *= kept;
  float total = 0.0, asked = 0.0;
  int exponent = cells.at[cell].exponent;
  for (uint k = 0u; k < slots; ++k) {
    float left = cells.at[cell].left[k] + fixed_to_float(cells.at[cell].sum_left[k], exponent);
    float right = cells.at[cell].right[k] + fixed_to_float(cells.at[cell].sum_right[k], exponent);
    float now = fixed_to_float(cells.at[cell].sum_expected[k], exponent) / cells.at[cell].response[k];
    cells.at[cell].left[k] = left * kept;
    cells.at[cell].right[k] = right * kept;
    cells.at[cell].asked[k] = (cells.at[cell].asked[k] + now) * kept;
    cells.at[cell].sum_left[k] = uint64_t(0u);
    cells.at[cell].sum_right[k] = uint64_t(0u);
    cells.at[cell].sum_expected[k] = uint64_t(0u);
    total += (left + right) * kept;
    asked += cells.at[cell].asked[k];
  }
  cells.at[cell].evidence = evidence;
  cells.at[cell].mean = total / evidence;
  if (total > 0.0) cells.at[cell].exponent = fixed_exponent(total / evidence);

  for (uint change = 0u; change < HW_LIGHT_CELL_CHANGES && total > 0.0; ++change) {
    // The brightest part that is no single light yet, and the darkest pair that one node could stand for.
    uint brightest = HW_NONE;
    float most = total / float(HW_LIGHT_CELL_SLOTS);
    for (uint k = 0u; k < slots; ++k) {
      float light = cells.at[cell].left[k] + cells.at[cell].right[k];
      if (light > most && light_cell_can_split(cells, cell, k)) most = light, brightest = k;
    }
    if (brightest == HW_NONE) break;
    if (slots == HW_LIGHT_CELL_SLOTS) {
      uint darkest = HW_NONE, parent = HW_NONE;
      float least = 0.25 * most;
      for (uint k = 0u; k + 1u < slots; ++k) {
        float light = cells.at[cell].left[k] + cells.at[cell].right[k] + cells.at[cell].left[k + 1u] +
                      cells.at[cell].right[k + 1u];
        if (light >= least || k == brightest || k + 1u == brightest) continue;
        uint above = light_cell_parent(cells.at[cell].node[k], cells.at[cell].node[k + 1u], cells.at[cell].first[k]);
        if (above != HW_NONE) least = light, darkest = k, parent = above;
      }
      if (darkest == HW_NONE) break;
      light_cell_merge(cells, cell, slots, darkest, parent);
      slots -= 1u;
      if (brightest > darkest) brightest -= 1u;
    }
    light_cell_split(cells, cell, slots, brightest);
    slots += 1u;
  }
  cells.at[cell].slots = slots;
  light_cell_weigh(cells, cell, slots, HW_CELLS.floor, total, asked);
}
