// SPDX-License-Identifier: Apache-2.0
// Offers canonical samples to the cells their surfaces lie in: the temporal reuse of SivaramWSSR (algorithm 3, lines 5-6;
// section 4.2), with the samples of one pass taken together. A race decides who wins, sums are in fixed point, so the
// order of threads and tiles is no matter.
//
// The paper's grid takes up to M = 100 samples a cell and frame, the first to come. Here each is taken with the
// probability that would have left as many of the last pass's.
// variant cell_insert_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/reuse_cells.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  UintBuffer(HW_REUSE.path_cells).at[path] = HW_NONE;
  ReuseSurface surface = reuse_surface_load(HW_REUSE.targets, path);
  Reservoir r = reservoir_load(HW_REUSE.reservoirs, path);
  if (surface.key == HW_NONE || !(r.confidence > 0.0)) return;
  uint cell = cell_of(surface.position);
  if (cell == HW_NONE) return;
  PathState state = path_load(path);
  uint random = random_stream(state.seed, HW_REUSE.pass, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_CELL, HW_FRAME.seed);
  CellArray cells = CellArray(HW_REUSE.cells);
  if (atomicAdd(cells.at[cell].offered, 1u) == 0u) queue_push(HW_REUSE.touched, cell);
  float taken = float(HW_REUSE.cell_inputs) / float(max(cells.at[cell].inputs, 1u));
  if (HW_REUSE.cell_inputs > 0u && random_next(random) >= taken) return;
  float weight = r.confidence * stream_weight(r, r.target);
  uint64_t key = race_key(weight, random_next(random), cell_sample_id(state));
  atomicAdd(cells.at[cell].count, uint(r.confidence));
  if (key == race_none()) return;
  atomicAdd(cells.at[cell].sum, fixed_from_float(weight, HW_REUSE.fixed_exponent));
  atomicMin(cells.at[cell].best, key);
  KeyArray(HW_REUSE.race_keys).at[path] = key;
  UintBuffer(HW_REUSE.path_cells).at[path] = cell;
}
