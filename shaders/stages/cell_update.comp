// SPDX-License-Identifier: Apache-2.0
// After a pass: what each cell gathered is merged into what it holds (SivaramWSSR, algorithm 1), by weights 1/M as the
// paper has it. One thread for each cell of the queue, those that were offered samples.
//
// A reservoir with an unbounded history freezes: in the end no new sample gets in. `history_passes` bounds it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/reuse_cells.glsl"
layout(local_size_x = 64) in;

void update(uint i) {
  CellArray cells = CellArray(HW_REUSE.cells);
  ReuseCell cell = cells.at[i];
  bool keeps = reuse_has(HW_REUSE_TEMPORAL);
  float count = float(cell.count);
  float old = keeps ? cell.held.confidence : 0.0;
  if (HW_REUSE.history_passes > 0.0) old = min(old, HW_REUSE.history_passes * max(count, 1.0));
  float old_sum = old * stream_weight(cell.held, cell.held.target);
  float new_sum = cell.best == race_none() ? 0.0 : fixed_to_float(cell.sum, HW_REUSE.fixed_exponent);
  uint random = random_stream(i, HW_REUSE.pass, 0u, HW_STREAM_CELL, HW_FRAME.seed);
  ReservoirStream stream = stream_begin();
  stream_add(stream, cell.held.light, cell.held.u, cell.held.v, old_sum, cell.held.target, old, 0.0);
  stream_add(stream, cell.light, cell.u, cell.v, new_sum, cell.target, count, random_next(random));
  cells.at[i].held = stream_end_count(stream);
  cells.at[i].sum = uint64_t(0u);
  cells.at[i].best = race_none();
  cells.at[i].inputs = cell.offered;
  cells.at[i].count = 0u;
  cells.at[i].offered = 0u;
  cells.at[i].light = HW_NONE;
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  uint stride = gl_NumWorkGroups.x * HW_GROUP_SIZE;
  for (uint at = gl_GlobalInvocationID.x; at < queue.header.count; at += stride) update(queue.path[at]);
}
