// SPDX-License-Identifier: Apache-2.0
// The paths that lead their cells' races after record_offer write down their light sample and their surface. A later
// wave may beat them.
// variant record_winner_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/record_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  uint cell = UintBuffer(HW_REUSE.path_cells).at[path];
  if (cell == HW_NONE) return;
  RecordCell race = RecordCellArray(HW_REUSE.record_cells).at[cell];
  uint key = record_key(path_load(path));
  ReuseSurface surface = reuse_surface_load(HW_REUSE.targets, path);
#ifdef HW_CELLS_TREE
  if (race.worst == key) WitnessArray(HW_REUSE.witnesses).at[cell] = surface.position;
#endif
  if (race.best != key) return;
  uint64_t next = HW_REUSE.next_records + uint64_t(cell) * HW_REUSE_RECORD_BYTES;
  reservoir_store(next, 0u, reservoir_load(HW_REUSE.reservoirs, path));
  reuse_surface_store(next + HW_REUSE_RECORD_SURFACE, 0u, surface);
}
