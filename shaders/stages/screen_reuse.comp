// SPDX-License-Identifier: Apache-2.0
// ReSTIR (Bitterli et al. 2020): merges a surface's canonical sample with reservoirs of the last pass, its own pixel's
// (temporal) and those of pixels about it (spatial), in one step as Wyman and Panteleev 2021 do. Reading the last pass
// alone makes the picture the same for any order of tiles.
//
// Departures: the paper (SivaramWSSR, section 5) merges temporally, then spatially within a frame. For surfaces seen
// after a bounce (restir-reproject, section 3.1) the reservoirs about the point's place on the film are merged, and none
// is stored.
//
// Weights: 1/M, 1/Z or defensive pairwise MIS (lib/reservoir.h), with p_hat at the surfaces that the reservoirs were
// made for. With MIS weights the result is unbiased: the canonical sample has full support. screen_merge is the kernel
// of unbiased estimators.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/screen_neighbours.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  PathState state = path_load(path);
  Reservoir canonical = reservoir_load(HW_REUSE.reservoirs, path);
  ReuseSurface mine = reuse_surface_load(HW_REUSE.targets, path);
  uint bounce = path_bounce(state.bounces);
  bool primary = bounce == 0u && (state.flags & HW_PATH_REUSED) == 0u;
  // Nothing to share: indirect hits of `restir`, and mirrors and windows, behind which the first surface may still come.
  if (!primary && !reuse_has(HW_REUSE_REPROJECT) || mine.key == HW_NONE) return;
  TargetSurface surface = target_surface(mine);

  // An occluded candidate stands for darkness (Bitterli et al. 2020, visibility reuse).
  if (primary && reuse_has(HW_REUSE_VISIBLE) && canonical.light != HW_NONE) {
    LightTable lights = LightTable(HW_ROOT.lights);
    bool asked = lights.at[canonical.light].type == HW_LIGHT_WORLD ||
                 (lights.at[canonical.light].flags & HW_LIGHT_CAST_SHADOW) != 0u;
    if (asked && UintBuffer(HW_FRAME.shadow_hits).at[path] != 0u) canonical = reservoir_empty(canonical.confidence);
  }

  ScreenHome home = screen_home(path, state, mine.position, primary);
  uint neighbours = reuse_has(HW_REUSE_SPATIAL) ? HW_REUSE.neighbours : 0u;
  uint first = reuse_has(HW_REUSE_TEMPORAL) ? 0u : 1u;
  uint count = home.pixel != HW_NONE ? neighbours + 1u : 0u;
  uint random = random_stream(state.seed, HW_REUSE.pass, bounce + state.transparent, HW_STREAM_REUSE, HW_FRAME.seed);
  bool mis = HW_WEIGHTS == HW_REUSE_WEIGHTS_MIS;

  // Number 0 is the pixel itself, the others lie in a disk about it. Which take part is decided by surfaces alone, never
  // by samples. Pass 0 adds up their confidences, which pairwise weights need beforehand; pass 1 merges; pass 2 counts
  // the confidences at which the merged sample could have been made (1/Z).
  float c_1 = canonical.confidence;
  float c_all = c_1;
  float m_1 = 0.0;
  float canonical_here = reuse_target_of(surface, canonical);
  ReservoirStream stream = stream_begin();
  Reservoir merged = reservoir_empty(0.0);
  float support = 0.0;
  uint passes = HW_WEIGHTS == HW_REUSE_WEIGHTS_INVERSE_Z ? 3u : 2u;
  for (uint pass = mis ? 0u : 1u; pass < passes; ++pass) {
    uint draws = random;
    for (uint i = first; i < count; ++i) {
      uint pixel;
      ReuseSurface there;
      bool taken = screen_neighbour(home, i, surface.normal, mine.key, draws, pixel, there);
      float u = random_next(draws);
      if (!taken) continue;
      Reservoir r_i = reservoir_load(HW_REUSE.screen, pixel);
      float c_i = HW_REUSE.confidence_cap > 0.0 ? min(r_i.confidence, HW_REUSE.confidence_cap) : r_i.confidence;
      if (pass == 0u) {
        c_all += c_i;
        continue;
      }
      if (pass == 2u) {
        float p = reuse_target_of(target_surface(there), merged);
        support += p > 0.0 ? c_i : 0.0;
        continue;
      }
      float here = reuse_target_of(surface, r_i);
      float weight = stream_weight(r_i, here) * c_i;
      if (mis) {
        TargetSurface other = target_surface(there);
        float own = reuse_target_of(other, r_i);
        float canonical_there = reuse_target_of(other, canonical);
        weight = stream_weight(r_i, here) * mis_pairwise(c_i, c_1, c_all, own, here);
        m_1 += mis_pairwise_canonical(c_i, c_1, c_all, canonical_there, canonical_here);
      }
      stream_add(stream, r_i.light, r_i.u, r_i.v, weight, here, c_i, u);
    }
    if (pass == 1u) {
      m_1 += mis_pairwise_base(c_1, c_all);
      float weight = stream_weight(canonical, canonical_here) * (mis ? m_1 : c_1);
      stream_add(stream, canonical.light, canonical.u, canonical.v, weight, canonical_here, c_1, random_next(draws));
      merged = mis ? stream_end_mis(stream) : stream_end_count(stream);
    }
  }
  if (HW_WEIGHTS == HW_REUSE_WEIGHTS_INVERSE_Z && merged.light != HW_NONE)
    merged = stream_end_support(stream, support + c_1);  // it was chosen by p_hat here, so that is positive

  reservoir_store(HW_REUSE.reservoirs, path, merged);
  if (!primary) return;
  reservoir_store(HW_REUSE.next_screen, state.pixel, reuse_has(HW_REUSE_TEMPORAL) ? merged : canonical);
  reuse_surface_store(HW_REUSE.next_screen_surfaces, state.pixel, mine);
  PathArray(HW_FRAME.paths).at[path].flags = state.flags | HW_PATH_REUSED;
}
