// SPDX-License-Identifier: Apache-2.0
// Light samples of one surface by the cell of `wssr-hash` that it lies in. Nodes of the cell's cut are drawn by the light
// to be expected from each at this very surface, lights below them by the tree, both with exact probabilities. Nothing
// of a sample outlives its path but what it teaches the cell, so that samples are unbiased whatever has been learned.
#ifndef HW_LIGHT_CELL_DRAW_GLSL
#define HW_LIGHT_CELL_DRAW_GLSL
#include "light_cell_lookup.glsl"
#include "light_proxy.h"
#include "reservoir_race.h"

// Of the surface under way. What to expect from the slots up to each is kept in registers: loops over it have no jump.
uint light_cell_here;
LightTreeReceiver light_cell_receiver;
float light_cell_upto[HW_LIGHT_CELL_SLOTS];
float light_cell_all;
uint64_t light_cell_expects;
float light_cell_teaches;

// Looks up the surface's cell, for so many light samples. One that is missing is asked for.
void light_cell_enter(uint path, PathState state, SurfacePoint point, uint samples) {
  light_cell_receiver = LightTreeReceiver(point.position, octahedral_unpack(point.receiver),
                                          (point.receiver & HW_RECEIVER_TRANSMITS) != 0u);
  float brightness = luminance(max(state.throughput, vec3(0.0)));
  light_cell_teaches = brightness > 0.0 ? 1.0 / brightness : 0.0;
  LightCellKey key = light_cell_of(state, point);
  light_cell_here = light_cell_find(key);
  light_cell_all = 0.0;
  UintBuffer(HW_CELLS.visited).at[path] = light_cell_here;
  if (light_cell_here == HW_NONE) {
    uint bucket = light_cell_bucket(key);
    LightCellRequestArray(HW_CELLS.wanted).at[path] = LightCellRequest(key.tag, bucket, key.center, 0u);
    atomicMin(LightCellRequestArray(HW_CELLS.requests).at[bucket].tag, key.tag);
    queue_push(HW_CELLS.missing, path);
    return;
  }
  LightCellArray cells = LightCellArray(HW_CELLS.cells);
  atomicAdd(cells.at[light_cell_here].samples, samples);
  cells.at[light_cell_here].used = HW_CELLS.pass;
  [[unroll]] for (uint k = 0u; k < HW_LIGHT_CELL_SLOTS; ++k) {
    light_cell_all += light_cell_expected(light_cell_here, k, light_cell_receiver);
    light_cell_upto[k] = light_cell_all;
  }
  light_cell_expects = fixed_from_float(light_cell_all / float(samples), cells.at[light_cell_here].exponent);
}

// A light with u in [0, 1): its index, its probability, and the slot it is in; HW_NONE with pdf 0: none. Without a cell it
// is the tree's: the walk down is the same code, which drivers that run both sides of a branch would else run twice.
uint light_cell_draw(float u, out float pdf, out uint slot) {
  bool known = light_cell_here != HW_NONE;
  float at = u * light_cell_all;
  float below = 0.0, above = light_cell_all;
  slot = 0u;
  [[unroll]] for (uint k = 0u; k < HW_LIGHT_CELL_SLOTS - 1u; ++k) {
    bool past = at >= light_cell_upto[k];
    slot += past ? 1u : 0u;
    below = past ? light_cell_upto[k] : below;
    above = past ? above : min(above, light_cell_upto[k]);
  }
  float expected = above - below;
  uint node = 0u;
  if (known && expected > 0.0) {  // else no light can reach here, and `slot` may be none of the cell's
    LightCellArray cells = LightCellArray(HW_CELLS.cells);
    atomicAdd(cells.at[light_cell_here].sum_expected[slot], light_cell_expects);
    node = light_cell_uint(light_cell_here, HW_LIGHT_CELL_UINT_NODE + slot);
    u = clamp((at - below) / max(expected, 1e-30), 0.0, 0.99999994);
  }
  uint light = light_tree_draw(light_tree_tables(), node, light_cell_receiver, u, pdf);
  pdf *= known ? expected / max(light_cell_all, 1e-30) : 1.0;
  return pdf > 0.0 ? light : HW_NONE;
}
#endif
