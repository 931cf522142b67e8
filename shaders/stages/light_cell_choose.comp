// SPDX-License-Identifier: Apache-2.0
// `wssr-hash` at every surface: its cell, and the lights of all its light samples. Nodes of the cell's cut are drawn by
// the light to be expected from each at this very surface, lights below them by the tree, both with exact
// probabilities; with several candidates a sample, one is kept by resampling (Talbot 2005). Nothing of a sample outlives
// its path but what it teaches the cell, so that samples are unbiased whatever has been learned.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "lib/light_cell_lookup.glsl"
#include "lib/reservoir_race.h"
#include "lib/reuse.glsl"
layout(local_size_x = 64) in;

uint look_up(uint path, LightCellKey key) {
  uint cell = light_cell_find(key);
  if (cell == HW_NONE) {
    atomicMin(LightCellRequestArray(HW_CELLS.requests).at[light_cell_bucket(key)].tag, key.tag);
    queue_push(HW_CELLS.missing, path);
  }
  return cell;
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  PathState state = path_load(path);
  SurfacePoint point = surface_load(path);
  uint samples = light_samples_at(state);
  LightChoiceArray chosen = LightChoiceArray(HW_CELLS.chosen);
  uint first_choice = path * HW_FRAME.light_samples;
  LightChoice choice;
  choice.cell = HW_NONE;
  choice.light = HW_NONE;
  choice.weight = 0.0;
  choice.pdf = 0.0;
  choice.teaches = 0.0;
  choice.slot = 0u;
  if ((point.flags & HW_SURFACE_DELTA_ONLY) != 0u) {
    chosen.at[first_choice] = choice;
    return;
  }
  ClosureList list = closures_at(HW_FRAME.closures + uint64_t(path) * uint64_t(HW_MAX_CLOSURES * HW_CLOSURE_BYTES),
                                 point.closure_count);
  ReuseSurface surface = reuse_surface(list, point.position, -ray_load(path).direction, point.shading_normal, 0u);
  reuse_surface_store(HW_REUSE.targets, path, surface);
  TargetSurface target = target_surface(surface);
  bool transmits = (point.receiver & HW_RECEIVER_TRANSMITS) != 0u;
  LightTreeReceiver receiver = LightTreeReceiver(point.position, octahedral_unpack(point.receiver), transmits);
  uint cell = look_up(path, light_cell_of(state, point, target));
  choice.cell = cell;
  float brightness = luminance(max(state.throughput, vec3(0.0)));
  choice.teaches = brightness > 0.0 ? 1.0 / brightness : 0.0;

  // What to expect from each node of the cut.
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  float expected[HW_LIGHT_CELL_SLOTS];
  uint slots = cell != HW_NONE ? cells.at[cell].slots : 0u;
  float all = 0.0;
  uint node = 0u;
  for (uint k = 0u; k < slots; ++k) {
    expected[k] = light_cell_expected(cell, k, receiver, node);
    all += expected[k];
  }
  uint count = HW_CELLS.candidates;
  float share = 1.0 / float(count * samples);
  uint64_t expects = uint64_t(0u);
  if (slots > 0u) {
    atomicAdd(cells.at[cell].samples, samples);
    cells.at[cell].used = HW_CELLS.pass;
    expects = fixed_from_float(all * share, HW_CELLS.fixed_exponent);
  }

  uint random = random_stream(state.seed, state.sample_index, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_CANDIDATES, HW_FRAME.seed);
  uint slot = 0u;
  float below = 0.0;  // expected from the slots before `slot`
  for (uint number = 0u; number < samples; ++number) {
    ReservoirStream stream = stream_begin();
    for (uint i = 0u; i < count; ++i) {
      // All candidates of a surface share the strata of one distribution, in order.
      float u = min((float(number * count + i) + random_next(random)) * share, 0.99999994);
      float chance = 1.0;
      node = 0u;
      if (slots > 0u) {
        float at = u * all;
        while (slot + 1u < slots && at >= below + expected[slot]) below += expected[slot], slot += 1u;
        chance = all > 0.0 ? expected[slot] / all : 0.0;
        u = clamp((at - below) / max(expected[slot], 1e-30), 0.0, 0.99999994);
        light_cell_slot(cell, slot, node);
        if (chance > 0.0) atomicAdd(cells.at[cell].sum_expected[slot], expects);
      }
      float pdf = 0.0;
      uint light = chance > 0.0 ? light_tree_sample(node, receiver.position, receiver.normal, transmits, u, pdf) : HW_NONE;
      pdf *= chance;
      float p_hat = light != HW_NONE && pdf > 0.0 ? 1.0 : 0.0;
      if (count > 1u && p_hat > 0.0) {
        LightProxy proxy = proxy_load(light);
        proxy.inverse_choice = 1.0 / pdf;
        p_hat = target_value(target, proxy, float(count * samples));
      }
      stream_add(stream, light, pdf, uintBitsToFloat(slot), p_hat > 0.0 ? p_hat / pdf : 0.0, p_hat, 1.0, random_next(random));
    }
    Reservoir r = stream_end_count(stream);
    choice.light = r.light;
    choice.weight = r.weight;
    choice.pdf = r.u * float(count);
    choice.slot = floatBitsToUint(r.v);
    chosen.at[first_choice + number] = choice;
  }
}
