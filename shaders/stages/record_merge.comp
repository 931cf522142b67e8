// SPDX-License-Identifier: Apache-2.0
// `wssr-kd`, `wssr-grid` and `wssr-grid-reproject`, unbiased: merges a surface's canonical sample with the records of
// cells about its own by MIS weights (lib/reuse_merge.glsl), at every bounce. Cells are read as the last pass left them.
//
// Which records take part is decided by where they lie, how old they are and which way their surfaces face. Beyond the
// grid the canonical sample stands alone.
// variant record_merge_tree: HW_CELLS_TREE
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/record_cells.glsl"
layout(local_size_x = 64) in;

Reservoir merge_sample(uint cell) { return record_sample(cell); }
ReuseSurface merge_surface(uint cell) { return record_surface(cell); }
#include "lib/reuse_merge.glsl"

const uint kTries = 8u;                // for each neighbour: most cells of a grid are air
const float kAlikeCosine = 0.5;        // 60 degrees: surfaces that face elsewhere know other lights

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  ReuseSurface mine = reuse_surface_load(HW_REUSE.targets, path);
  if (mine.key == HW_NONE) return;
  RecordPlace place = record_place(mine.position);
  if (place.own == HW_NONE) return;
  PathState state = path_load(path);
  TargetSurface surface = target_surface(mine);
  uint random = random_stream(state.seed, HW_REUSE.pass, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_REUSE, HW_FRAME.seed);
#ifndef HW_CELLS_TREE
  if (reuse_has(HW_REUSE_TEMPORAL) && record_is_fresh(place.own)) merge_take(place.own);
#endif
  uint k = reuse_has(HW_REUSE_SPATIAL) ? HW_REUSE.neighbours : 0u;
  for (uint i = 0u; i < k; ++i) {
    bool taken = false;
    for (uint t = 0u; t < kTries && !taken; ++t) {
      uint other = record_neighbour(place, i, k, random_next(random), random);
      taken = other != HW_NONE && record_is_fresh(other) &&
              dot(octahedral_unpack(record_surface(other).normal), surface.normal) >= kAlikeCosine;
      if (taken) merge_take(other);
    }
  }
  reservoir_store(HW_REUSE.reservoirs, path, merge_unbiased(reservoir_load(HW_REUSE.reservoirs, path), surface, random));
}
