// SPDX-License-Identifier: Apache-2.0
// `wssr-hash` at every surface: its cell, and the lights of all its light samples. Nodes of the cell's cut are drawn by
// the light to be expected from each at this very surface, lights below them by the tree, both with exact
// probabilities; with several candidates a sample, one is kept by resampling (Talbot 2005). Nothing of a sample outlives
// its path but what it teaches the cell, so that samples are unbiased whatever has been learned.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/light_cell_lookup.glsl"
#include "lib/light_leaf.h"
#include "lib/reservoir_race.h"
#include "lib/reuse.glsl"
layout(local_size_x = 64) in;

void look_up_failed(uint path, LightCellKey key, ReuseSurface surface) {
  reuse_surface_store(HW_REUSE.targets, path, surface);
  atomicMin(LightCellRequestArray(HW_CELLS.requests).at[light_cell_bucket(key)].tag, key.tag);
  queue_push(HW_CELLS.missing, path);
}

LightLeaf leaf_load(uint place) {
  Words w = Words(HW_CELLS.leaves + uint64_t(place) * HW_LIGHT_LEAF_BYTES);
  uint64_t w1 = w.at[1], w2 = w.at[2], w3 = w.at[3];
  LightLeaf l;
  l.center = vec3(word_floats(w.at[0]), word_low_float(w1));
  l.intensity = word_high_float(w1);
  l.axis = word_low(w2);
  l.emission = word_high(w2);
  l.extent = word_low(w3);
  l.light = word_high(w3);
  return l;
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  PathState state = path_load(path);
  SurfacePoint point = surface_load(path);
  uint samples = light_samples_at(state);
  LightChoice choice;
  choice.cell = HW_NONE;
  choice.light = HW_NONE;
  choice.weight = 0.0;
  choice.pdf = 0.0;
  choice.teaches = 0.0;
  choice.slot = 0u;
  if ((point.flags & HW_SURFACE_DELTA_ONLY) != 0u) {
    light_choice_store(path, 0u, choice);
    return;
  }
  ClosureList list = closures_at(HW_FRAME.closures + uint64_t(path) * uint64_t(HW_MAX_CLOSURES * HW_CLOSURE_BYTES),
                                 point.closure_count);
  ReuseSurface surface = reuse_surface(list, point.position, -ray_load(path).direction, point.shading_normal, 0u);
  TargetSurface target = target_surface(surface);
  LightCellKey key = light_cell_of(state, point, target);
  uint cell = light_cell_find(key);
  choice.cell = cell;
  float brightness = luminance(max(state.throughput, vec3(0.0)));
  choice.teaches = brightness > 0.0 ? 1.0 / brightness : 0.0;
  uint count = HW_CELLS.candidates;
  uint random = random_stream(state.seed, state.sample_index, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_CANDIDATES, HW_FRAME.seed);

  LightTreeReceiver receiver = LightTreeReceiver(point.position, octahedral_unpack(point.receiver),
                                                 (point.receiver & HW_RECEIVER_TRANSMITS) != 0u);
  if (cell == HW_NONE) {
    look_up_failed(path, key, surface);
    for (uint number = 0u; number < samples; ++number) {
      float u = min((float(number) + random_next(random)) / float(samples), 0.99999994);
      float pdf;
      choice.light = light_tree_draw(light_tree_tables(), 0u, receiver, u, pdf);
      choice.weight = pdf > 0.0 ? 1.0 / pdf : 0.0;
      choice.pdf = pdf * float(count);
      light_choice_store(path, number, choice);
    }
    return;
  }

  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  atomicAdd(cells.at[cell].samples, samples);
  cells.at[cell].used = HW_CELLS.pass;

  // What to expect from the slots up to each: in registers, as loops without a jump.
  float upto[HW_LIGHT_CELL_SLOTS];
  float all = 0.0;
  [[unroll]] for (uint k = 0u; k < HW_LIGHT_CELL_SLOTS; ++k) {
    all += light_cell_expected(cell, k, receiver);
    upto[k] = all;
  }
  float share = 1.0 / float(count * samples);
  uint64_t expects = fixed_from_float(all * share, HW_CELLS.fixed_exponent);
  for (uint number = 0u; number < samples; ++number) {
    float sum = 0.0, kept = 0.0;
    choice.light = HW_NONE;
    choice.pdf = 0.0;
    for (uint i = 0u; i < count; ++i) {
      // All candidates of a surface share the strata of one distribution, in order.
      float at = min((float(number * count + i) + random_next(random)) * share, 0.99999994) * all;
      uint slot = 0u;
      float below = 0.0, above = all;
      [[unroll]] for (uint k = 0u; k < HW_LIGHT_CELL_SLOTS - 1u; ++k) {
        bool past = at >= upto[k];
        slot += past ? 1u : 0u;
        below = past ? upto[k] : below;
        above = past ? above : min(above, upto[k]);
      }
      float expected = above - below;
      if (!(expected > 0.0)) continue;
      atomicAdd(cells.at[cell].sum_expected[slot], expects);
      float u = clamp((at - below) / expected, 0.0, 0.99999994);
      float chance;
      uint light = light_tree_draw(light_tree_tables(), cells.at[cell].node[slot], receiver, u, chance);
      if (light == HW_NONE) continue;
      float pdf = chance * (expected / all);
      float p_hat = 1.0;
      if (count > 1u) {
        LightLeaf leaf = leaf_load(UintArray(HW_ROOT.light_position).at[light]);
        p_hat = target_value(target, light_leaf_proxy(leaf, pdf), float(count * samples));
      }
      float weight = p_hat / pdf;
      if (!reservoir_usable(weight)) continue;
      sum = min(sum + weight, HW_INFINITY);
      if (choice.light != HW_NONE && random_next(random) * sum >= weight) continue;
      choice.light = light;
      choice.pdf = pdf;
      choice.slot = slot;
      kept = p_hat;
    }
    choice.weight = choice.light != HW_NONE ? sum / (float(count) * kept) : 0.0;
    choice.pdf *= float(count);
    light_choice_store(path, number, choice);
  }
}
