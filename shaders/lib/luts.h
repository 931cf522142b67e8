// SPDX-License-Identifier: Apache-2.0
// Look-up tables of albedos: layout and interpolation. Filled by core/materials/luts.cpp: floats that C++ reads through
// hw::albedo_luts(), and for GLSL at Root::luts one word an entry that holds the corners of its cell, so that blending
// between four of them is one load (lib/words.glsl says why that counts). An integral's word has 4 x 16 bit,
// normalised: the entry, the next in x, and the two above; a sheen's word two floats, the entry and the next in x.
//
// All are sampled on [0, 1] with points at both ends and blended linearly. r: roughness (square root of alpha), c:
// cosine of the viewing angle, z: sqrt(|ior - 1| / (ior + 1)), which is f0^(1/4).
//   E            32 x 32       [c][r]     albedo of GGX reflection without Fresnel
//   E_MEAN       32            [r]        its mean over the cosine-weighted hemisphere
//   GLASS        16 x 16 x 16  [z][c][r]  albedo of GGX glass, ior > 1
//   GLASS_MEAN   16 x 16       [z][r]
//   GLASS_INV, GLASS_INV_MEAN             the same from the dense side (1 / ior)
//   RISE_IOR     16 x 16 x 16  [z][c][r]  mean of fresnel_rise over visible normals that reflect upwards
//   RISE_SCHLICK 16 x 16       [c][r]     the same of (1 - cos)^5
//   SHEEN        3 x 32 x 32   [r][c]     linearly transformed cosine (a, b) and albedo of the sheen
#ifndef HW_LUTS_H
#define HW_LUTS_H
#include "../shared/portable.h"

HW_NAMESPACE_BEGIN

HW_CONST uint HW_LUT_E = 0u;
HW_CONST uint HW_LUT_E_MEAN = 1024u;
HW_CONST uint HW_LUT_GLASS = 1056u;
HW_CONST uint HW_LUT_GLASS_MEAN = 5152u;
HW_CONST uint HW_LUT_GLASS_INV = 5408u;
HW_CONST uint HW_LUT_GLASS_INV_MEAN = 9504u;
HW_CONST uint HW_LUT_RISE_IOR = 9760u;
HW_CONST uint HW_LUT_RISE_SCHLICK = 13856u;
HW_CONST uint HW_LUT_SHEEN = 14112u;
HW_CONST uint HW_LUT_COUNT = 17184u;

HW_NAMESPACE_END

#ifdef __cplusplus
namespace hw {
const float* albedo_luts();  // core/materials/luts.h

// Entries i, i + 1, i + row, i + row + 1.
inline vec4 lut_cell(uint i, uint row) {
  const float* t = albedo_luts() + i;
  return vec4(t[0], t[1], t[row], t[row + 1]);
}
inline vec2 lut_pair(uint i) { return vec2(albedo_luts()[i], albedo_luts()[i + 1]); }
}  // namespace hw
#else
#include "words.glsl"
// `row` is in the table's words already.
vec4 lut_cell(uint i, uint row) {
  uint64_t w = word_at(HW_ROOT.luts, i);
  return vec4(unpackUnorm2x16(word_low(w)), unpackUnorm2x16(word_high(w)));
}
vec2 lut_pair(uint i) { return word_floats(word_at(HW_ROOT.luts, i)); }
#endif

HW_NAMESPACE_BEGIN

// The cell that x in [0, 1] falls in along an axis of n points, and where in it.
HW_FN uint lut_place(uint n, float x, HW_OUT(float) t) {
  float p = clamp(x, 0.0f, 1.0f) * float(n - 1u);
  uint i = min(uint(p), n - 2u);
  t = p - float(i);
  return i;
}

HW_FN float lut_1d(uint first, uint n, float x) {
  float t;
  uint i = lut_place(n, x, t);
  vec4 c = lut_cell(first + i, 0u);
  return mix(c.x, c.y, t);
}

// x runs fastest; all axes have n points.
HW_FN float lut_2d(uint first, uint n, float x, float y) {
  float t, u;
  uint i = lut_place(n, x, t);
  uint j = lut_place(n, y, u);
  vec4 c = lut_cell(first + j * n + i, n);
  return mix(mix(c.x, c.y, t), mix(c.z, c.w, t), u);
}

HW_FN float lut_3d(uint first, uint n, float x, float y, float z) {
  float t;
  uint i = lut_place(n, z, t);
  return mix(lut_2d(first + i * n * n, n, x, y), lut_2d(first + (i + 1u) * n * n, n, x, y), t);
}

// One of the sheen's three tables.
HW_FN float lut_sheen(uint table, float cosine, float roughness) {
  float t, u;
  uint i = lut_place(32u, cosine, t);
  uint j = lut_place(32u, roughness, u);
  uint at = HW_LUT_SHEEN + 1024u * table + j * 32u + i;
  vec2 low = lut_pair(at);
  vec2 high = lut_pair(at + 32u);
  return mix(mix(low.x, low.y, t), mix(high.x, high.y, t), u);
}

HW_NAMESPACE_END
#endif
