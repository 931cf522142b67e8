// SPDX-License-Identifier: Apache-2.0
// Light samples that arrived teach the cells that proposed them: how much light came from which part of their cut. Over
// the queue of shadow rays, while their results are there. a: number of the light sample.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/light_cells.glsl"
#include "lib/light_proxy.h"
#include "lib/reservoir_race.h"
layout(local_size_x = 64) in;

// A sample counts as at most this many times what the cell is used to: one that was very unlikely says little.
const float HW_LIGHT_CELL_SURPRISE = 64.0;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  if (UintBuffer(HW_FRAME.shadow_hits).at[path] != 0u) return;
  LightChoice choice = light_choice_load(path, push.a);
  if (choice.cell == HW_NONE) return;
  ShadowState shadow = ShadowArray(HW_FRAME.shadows).at[path];
  float light = luminance(max(shadow.radiance, vec3(0.0))) * choice.teaches;
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  float mean = cells.at[choice.cell].mean;
  if (mean > 0.0) light = min(light, HW_LIGHT_CELL_SURPRISE * mean);
  uint place = UintArray(HW_ROOT.light_position).at[shadow.light];
  uint slot = choice.slot;
  uvec2 links = light_tree_links(HW_ROOT.light_tree, cells.at[choice.cell].node[slot]);
  bool right = links.x != HW_NONE && place >= links.y;
  uint64_t units = fixed_from_float(light, HW_CELLS.fixed_exponent);
  if (right) {
    atomicAdd(cells.at[choice.cell].sum_right[slot], units);
  } else {
    atomicAdd(cells.at[choice.cell].sum_left[slot], units);
  }
}
