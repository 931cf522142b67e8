// SPDX-License-Identifier: Apache-2.0
// Paths run for the records of the cells their surfaces lie in, by keys that know nothing of their samples: one of the
// pass's paths is kept, each with the same probability. A minimum of integers, so the order of threads and tiles is no
// matter. Its second half is record_winner.
// variant record_offer_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/record_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  ReuseSurface surface = reuse_surface_load(HW_REUSE.targets, path);
  uint cell = surface.key == HW_NONE ? HW_NONE : record_cell(surface.position);
  UintBuffer(HW_REUSE.path_cells).at[path] = cell;
  if (cell == HW_NONE) return;
  RecordCellArray cells = RecordCellArray(HW_REUSE.record_cells);
  if (atomicAdd(cells.at[cell].offered, 1u) == 0u) queue_push(HW_REUSE.touched, cell);
  uint key = record_key(path_load(path));
  atomicMin(cells.at[cell].best, key);
#ifdef HW_CELLS_TREE
  atomicMax(cells.at[cell].worst, key);
#endif
}
