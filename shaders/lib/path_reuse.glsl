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
#include "wave.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SharedVertexArray { SharedVertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SharedPairArray { SharedPair at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SharedShareArray { vec3 at[]; };

uint path_flags(uint path) { return word_low(word_at(HW_FRAME.paths + uint64_t(path) * HW_PATH_BYTES, 5u)); }

vec3 shares_of(vec3 part, vec3 total) {
  return vec3(total.x > 0.0 ? part.x / total.x : 0.0, total.y > 0.0 ? part.y / total.y : 0.0,
              total.z > 0.0 ? part.z / total.z : 0.0);
}

// Groups: eight pixels of a tile of 16 x 4, every fourth of every other row, so that no two are neighbours. In adaptive
// sampling of four blocks of the pass that follow each other, whatever blocks they are: a block has four groups.

// Which of its group the wave's path `number` is.
uint reuse_member(uint number) {
  if (HW_FRAME.sampled_blocks != 0ul) return number / HW_BLOCK_PIXELS % 4u | (number % HW_BLOCK_PIXELS / 8u) << 2u;
  uint pixel = HW_FRAME.first_pixel + number;
  uint x = pixel % HW_FRAME.region_width, y = pixel / HW_FRAME.region_width;
  return (x & 15u) >> 2u | ((y & 3u) >> 1u) << 2u;
}

// Path `member` of the group of path `number`; HW_NONE: it would lie outside of the picture.
uint reuse_other(uint number, uint member) {
  if (HW_FRAME.sampled_blocks != 0ul) {
    uint other = number / HW_REUSE_TILE * HW_REUSE_TILE + (member & 3u) * HW_BLOCK_PIXELS + number % 8u + (member >> 2u) * 8u;
    return other < HW_FRAME.wave_pixels ? other : HW_NONE;
  }
  uint width = HW_FRAME.region_width;
  uint pixel = HW_FRAME.first_pixel + number;
  uint x = pixel % width, y = pixel / width;
  x = (x & ~15u) + (x & 3u) + 4u * (member & 3u);
  y = (y & ~3u) + (y & 1u) + 2u * (member >> 2u);
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
