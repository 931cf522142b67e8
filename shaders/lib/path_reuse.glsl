// SPDX-License-Identifier: Apache-2.0
// Path reuse: pixels of a group share what their paths found (Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing
// by Re-Using Paths", with the balance heuristic over the group; Veach 1997).
//
// The first surface of a pixel that scatters light is its anchor; the next one on a path that left it diffusely is a
// shared vertex. Of the light there, the part reflected evenly is kept beside the path's own result, and every anchor of
// the group that sees the vertex takes it, weighed by all of the group's chances of finding it. Evenly: the same towards
// all of them, whoever met it, so that the weights sum to one over each way light can go. The rest stays the path's own.
#ifndef HW_PATH_REUSE_GLSL
#define HW_PATH_REUSE_GLSL
#include "sampler.h"
#include "wave.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SharedVertexArray { SharedVertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SharedPairArray { SharedPair at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SharedShareArray { vec3 at[]; };

uint path_flags(uint path) { return word_low(word_at(HW_FRAME.paths + uint64_t(path) * HW_PATH_BYTES, 5u)); }

vec3 shares_of(vec3 part, vec3 total) {
  return vec3(total.x > 0.0 ? part.x / total.x : 0.0, total.y > 0.0 ? part.y / total.y : 0.0,
              total.z > 0.0 ? part.z / total.z : 0.0);
}

// Groups: a tile of 16 x 4 pixels has eight, each with one pixel of each of its eight parts of 4 x 2; which one changes
// with the tile, the part and the sample, so that no pattern is left to see. In adaptive sampling a tile is four blocks
// of the pass that follow each other, whatever blocks they are, and a part half a block.
struct ReusePlace {
  uint tile;  // hash of it and the sample
  uint part;  // of the tile: which of its group the pixel is
  uint at;    // in the part
};

// Of the wave's path `number`.
ReusePlace reuse_place(uint number) {
  uint pixel = HW_FRAME.first_pixel + number;
  ReusePlace place;
  if (HW_FRAME.sampled_blocks != 0ul) {
    place.tile = pixel / HW_REUSE_TILE;
    place.part = pixel / 8u % 8u;
    place.at = pixel % 8u;
  } else {
    uint x = pixel % HW_FRAME.region_width, y = pixel / HW_FRAME.region_width;
    place.tile = (y >> 2u) << 16u | x >> 4u;
    place.part = (x & 15u) >> 2u | ((y & 3u) >> 1u) << 2u;
    place.at = (x & 3u) | (y & 1u) << 2u;
  }
  place.tile = sampler_hash_combine(sampler_hash_combine(place.tile, HW_FRAME.first_sample), HW_FRAME.seed);
  return place;
}

// (g ^ a) odd + b modulo 8: the place in the part of each group g.
uint reuse_place_of_group(uint tile, uint part, uint group) {
  uint h = sampler_hash(tile + part);
  return ((group ^ (h & 7u)) * (h >> 3u | 1u) + (h >> 28u)) & 7u;
}
// The inverse: an odd number is its own, modulo 8.
uint reuse_group_at(uint tile, uint part, uint at) {
  uint h = sampler_hash(tile + part);
  return (((at - (h >> 28u)) * (h >> 3u | 1u)) & 7u) ^ (h & 7u);
}

// Which of its group the wave's path `number` is.
uint reuse_member(uint number) { return reuse_place(number).part; }

// Path `member` of the group of path `number`; HW_NONE: it would lie outside of the picture.
uint reuse_other(uint number, uint member) {
  ReusePlace place = reuse_place(number);
  uint at = reuse_place_of_group(place.tile, member, reuse_group_at(place.tile, place.part, place.at));
  if (HW_FRAME.sampled_blocks != 0ul) {
    uint other = number / HW_REUSE_TILE * HW_REUSE_TILE + member * 8u + at;
    return other < HW_FRAME.wave_pixels ? other : HW_NONE;
  }
  uint width = HW_FRAME.region_width;
  uint pixel = HW_FRAME.first_pixel + number;
  uint x = pixel % width & ~15u, y = pixel / width & ~3u;
  x += (member & 3u) << 2u | (at & 3u);
  y += (member >> 2u) << 1u | at >> 2u;
  uint other = y * width + x - HW_FRAME.first_pixel;
  return x < width && other < HW_FRAME.wave_pixels ? other : HW_NONE;
}

// Of light that arrived at the camera by a path that is shared, bounded as result_clamp does: what goes to the vertex, not
// to the path's result.
vec3 reuse_put(uint path, vec3 light, bool here) {
  SharedVertexArray vertices = SharedVertexArray(HW_FRAME.shared_vertices);
  vec3 put = result_value(light * (here ? vertices.at[path].light_share : vertices.at[path].share));
  vertices.at[path].light += put;
  return put;
}
#endif
