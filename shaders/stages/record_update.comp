// SPDX-License-Identifier: Apache-2.0
// After a pass: the winners of its races are what surfaces read from now on. One thread for each cell of the queue,
// those that paths came by; the others keep what they have, until it is too old.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/record_cells.glsl"
layout(local_size_x = 64) in;

void update(uint i) {
  RecordCellArray cells = RecordCellArray(HW_REUSE.record_cells);
  uint64_t next = HW_REUSE.next_records + uint64_t(i) * HW_REUSE_RECORD_BYTES;
  reservoir_store(record_address(i), 0u, reservoir_load(next, 0u));
  reuse_surface_store(record_address(i) + HW_REUSE_RECORD_SURFACE, 0u,
                      reuse_surface_load(next + HW_REUSE_RECORD_SURFACE, 0u));
  RecordCell cell = cells.at[i];
  cell.made = HW_REUSE.pass + 1u;
  cell.seen = HW_REUSE.pass;
  cell.load = cell.offered;
  cell.best = HW_NONE;
  cell.worst = 0u;
  cell.offered = 0u;
  cells.at[i] = cell;
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  uint stride = gl_NumWorkGroups.x * HW_GROUP_SIZE;
  for (uint at = gl_GlobalInvocationID.x; at < queue.header.count; at += stride) update(queue.path[at]);
}
