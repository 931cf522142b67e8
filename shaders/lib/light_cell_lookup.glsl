// SPDX-License-Identifier: Apache-2.0
// Which cell of `wssr-hash` a path's surface asks, and whether the table has it.
#ifndef HW_LIGHT_CELL_LOOKUP_GLSL
#define HW_LIGHT_CELL_LOOKUP_GLSL
#include "camera.h"
#include "light_cell_key.h"
#include "light_cells.glsl"
#include "random.h"

// The key of a path's surface: the same for all of its light samples, another for each vertex, by jitter.
LightCellKey light_cell_of(PathState state, SurfacePoint point) {
  vec3 P = point.position, N = octahedral_unpack(point.receiver);
  bool glossy = (point.flags & HW_SURFACE_GLOSSY) != 0u;
  uint random = random_stream(state.seed, state.sample_index, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_CELL, HW_FRAME.seed);
  float across = random_next(random);
  vec2 u = vec2(across, random_next(random));
  bool perspective = HW_ROOT.camera.type != HW_CAMERA_ORTHOGRAPHIC;
  float away = perspective ? distance(P, camera_position(HW_ROOT.camera)) : 1.0;
  float width = light_cell_width(max(HW_CELLS.size * away, HW_CELLS.least_size));
  return light_cell_key(light_cell_jitter(P, N, width, u), width, light_cell_side(N) + (glossy ? 8u : 0u));
}

uint light_cell_bucket(LightCellKey key) { return key.bucket % HW_CELLS.buckets; }

// Index of the cell; HW_NONE: it is not there.
uint light_cell_find(LightCellKey key) {
  uint first = light_cell_bucket(key) * HW_LIGHT_CELL_WAYS;
  uint64_t tags = HW_CELLS.tags + uint64_t(first) * 4ul;
  uint64_t a = word_at(tags, 0u), b = word_at(tags, 1u);
  uint way = word_low(a) == key.tag   ? 0u
             : word_high(a) == key.tag ? 1u
             : word_low(b) == key.tag  ? 2u
             : word_high(b) == key.tag ? 3u
                                       : HW_NONE;
  return way == HW_NONE ? HW_NONE : first + way;
}
#endif
