// SPDX-License-Identifier: Apache-2.0
// The spatial reuse of SivaramWSSR: merges the reservoirs of neighbouring cells for one surface (algorithm 3, lines 9-15;
// section 4.2). Cells are read as the last pass left them.
//
// As in the paper the surface's own sample and, in the tree, its own leaf take no part, and weights are 1/M. Departures,
// which the switch for black cells undoes:
//  - a grid's neighbours are mostly empty, as surfaces are thin: empty ones are drawn again, up to kTries a neighbour;
//  - without any, the own cell is taken, and without that the canonical sample, where the paper's code leaves black.
// variant cell_reuse_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/reuse_cells.glsl"
layout(local_size_x = 64) in;

#ifdef HW_CELLS_TREE
const uint kTries = 1u;
#else
const uint kTries = 8u;
#endif

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  ReuseSurface mine = reuse_surface_load(HW_REUSE.targets, path);
  if (mine.key == HW_NONE) return;
  uint own = cell_of(mine.position);
  if (own == HW_NONE) return;  // beyond the grid: the canonical sample
  PathState state = path_load(path);
  TargetSurface surface = target_surface(mine);
  uint random = random_stream(state.seed, HW_REUSE.pass, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_REUSE, HW_FRAME.seed);
  bool black = reuse_has(HW_REUSE_BLACK);
  CellArray cells = CellArray(HW_REUSE.cells);
  uint k = reuse_has(HW_REUSE_SPATIAL) ? HW_REUSE.neighbours : 0u;
  float stratum = random_next(random);
  ReservoirStream stream = stream_begin();
  uint found = 0u;
  // Turn k is the own cell's, if nothing else was found.
  for (uint i = 0u; i <= k; ++i) {
    Reservoir r = reservoir_empty(0.0);
    if (i < k) {
      uint other = HW_NONE;
      for (uint t = 0u; t < (black ? 1u : kTries) && other == HW_NONE; ++t) {
        other = cell_neighbour(mine.position, i, k, stratum, random);
        if (other != HW_NONE && !(cells.at[other].held.confidence > 0.0)) other = HW_NONE;
      }
      if (other != HW_NONE) r = cell_held(other);
    } else if (found == 0u && !(black && k > 0u)) {
      r = cell_held(own);
    }
    if (!(r.confidence > 0.0)) continue;
    ++found;
    float here = reuse_target_of(surface, r);
    stream_add(stream, r.light, r.u, r.v, r.confidence * stream_weight(r, here), here, r.confidence, random_next(random));
  }
  if (found == 0u && !black) return;
  reservoir_store(HW_REUSE.reservoirs, path, stream_end_count(stream));
}
