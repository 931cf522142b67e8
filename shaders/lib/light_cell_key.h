// SPDX-License-Identifier: Apache-2.0
// Which cell of `wssr-hash` a surface belongs to: cubes of power-of-two width that grow with the distance from the
// camera, so that a cell covers about as many pixels everywhere (Binder et al. 2019, "Massively Parallel Path Space
// Filtering"), told apart by the axis that the normal follows most.
#ifndef HW_LIGHT_CELL_KEY_H
#define HW_LIGHT_CELL_KEY_H
#include "../shared/portable.h"
#include "frame.h"
#include "sampler.h"
HW_NAMESPACE_BEGIN

struct LightCellKey {
  uint tag;     // never 0 nor HW_NONE
  uint bucket;  // hash, to be taken modulo the buckets
  vec3 center;  // world space
  float width;  // [m]
};

// 0 to 5: +x, -x, +y, -y, +z, -z.
HW_FN uint light_cell_side(vec3 n) {
  vec3 a = vec3(abs(n.x), abs(n.y), abs(n.z));
  uint axis = a.x >= a.y && a.x >= a.z ? 0u : a.y >= a.z ? 1u : 2u;
  float along = axis == 0u ? n.x : axis == 1u ? n.y : n.z;
  return 2u * axis + (along < 0.0f ? 1u : 0u);
}

// Width of the cells at a point that are to be about `wanted` wide [m]: the power of two at or above it, in
// [2^-20, 2^40] m.
HW_FN float light_cell_width(float wanted) {
  float w = wanted > 1e-6f ? min(wanted, 1e12f) : 1e-6f;
  return exp2(clamp(ceil(log2(w)), -20.0f, 40.0f));
}

// `kind`: a number below 16 that tells apart what should not share a cell in the same place.
HW_FN LightCellKey light_cell_key(vec3 P, float width, uint kind) {
  vec3 cell = clamp(vec3(floor(P.x / width), floor(P.y / width), floor(P.z / width)), vec3(-1e9f), vec3(1e9f));
  uint h = sampler_hash(uint(int(cell.x)) ^ 0x68bc21ebu);
  h = sampler_hash_combine(h, uint(int(cell.y)));
  h = sampler_hash_combine(h, uint(int(cell.z)));
  h = sampler_hash_combine(h, floatBitsToUint(width) ^ kind);
  LightCellKey k;
  k.tag = h == 0u || h == HW_NONE ? 1u : h;
  k.bucket = sampler_hash(h ^ 0x02e5be93u);
  k.center = (cell + vec3(0.5f)) * width;
  k.width = width;
  return k;
}

// A point of the plane across N about P, up to half a width away along each of two axes: with a fresh one for every
// surface the edges of cells do not show.
HW_FN vec3 light_cell_jitter(vec3 P, vec3 N, float width, vec2 u) {
  vec3 x, y;
  warp_frame(N, x, y);
  return P + x * ((u.x - 0.5f) * width) + y * ((u.y - 0.5f) * width);
}

HW_NAMESPACE_END
#endif
