// SPDX-License-Identifier: Apache-2.0
// `restir` and `restir-reproject`, unbiased: merges a surface's canonical sample with the last pass's reservoirs of its
// own pixel and of pixels about it, by MIS weights (lib/reuse_merge.glsl). Surfaces seen after a bounce
// (restir-reproject) merge the pixels that show them, and nothing is stored for them. screen_reuse is the paper's.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/screen_neighbours.glsl"
layout(local_size_x = 64) in;

Reservoir merge_sample(uint pixel) { return reservoir_load(HW_REUSE.screen, pixel); }
ReuseSurface merge_surface(uint pixel) { return reuse_surface_load(HW_REUSE.screen_surfaces, pixel); }
#include "lib/reuse_merge.glsl"

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  PathState state = path_load(path);
  ReuseSurface mine = reuse_surface_load(HW_REUSE.targets, path);
  uint bounce = path_bounce(state.bounces);
  bool primary = bounce == 0u && (state.flags & HW_PATH_REUSED) == 0u;
  // Nothing to share: indirect hits of `restir`, and mirrors and windows, behind which the first surface may still come.
  if (!primary && !reuse_has(HW_REUSE_REPROJECT) || mine.key == HW_NONE) return;
  Reservoir canonical = reservoir_load(HW_REUSE.reservoirs, path);
  TargetSurface surface = target_surface(mine);
  uint random = random_stream(state.seed, HW_REUSE.pass, bounce + state.transparent, HW_STREAM_REUSE, HW_FRAME.seed);
  ScreenHome home = screen_home(path, state, mine.position, primary);
  uint neighbours = reuse_has(HW_REUSE_SPATIAL) ? HW_REUSE.neighbours : 0u;
  for (uint i = reuse_has(HW_REUSE_TEMPORAL) ? 0u : 1u; home.pixel != HW_NONE && i <= neighbours; ++i) {
    uint pixel;
    ReuseSurface there;
    if (screen_neighbour(home, i, surface.normal, mine.key, random, pixel, there)) merge_take(pixel);
  }
  Reservoir merged = merge_unbiased(canonical, surface, random);
  reservoir_store(HW_REUSE.reservoirs, path, merged);
  if (!primary) return;
  reservoir_store(HW_REUSE.next_screen, state.pixel, reuse_has(HW_REUSE_TEMPORAL) ? merged : canonical);
  reuse_surface_store(HW_REUSE.next_screen_surfaces, state.pixel, mine);
  PathArray(HW_FRAME.paths).at[path].flags = state.flags | HW_PATH_REUSED;
}
