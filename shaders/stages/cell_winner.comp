// SPDX-License-Identifier: Apache-2.0
// The samples that lead their cells' races after cell_insert write themselves down. A later wave may beat them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/reuse_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  uint cell = UintBuffer(HW_REUSE.path_cells).at[path];
  if (cell == HW_NONE) return;
  CellArray cells = CellArray(HW_REUSE.cells);
  if (cells.at[cell].best != KeyArray(HW_REUSE.race_keys).at[path]) return;
  Reservoir r = reservoir_load(HW_REUSE.reservoirs, path);
  cells.at[cell].light = r.light;
  cells.at[cell].u = r.u;
  cells.at[cell].v = r.v;
  cells.at[cell].target = r.target;
}
