// SPDX-License-Identifier: Apache-2.0
// Look-up tables of albedos: layout and interpolation. Filled by core/materials/luts.cpp; one array of floats, reached
// through Root::luts in GLSL and hw::albedo_luts() in C++.
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

#ifdef __cplusplus
namespace hw {
const float* albedo_luts();  // core/materials/luts.h
}
#define HW_LUT(i) hw::albedo_luts()[i]
#else
#ifndef HW_LUT
#define HW_LUT(i) FloatArray(HW_ROOT.luts).at[i]  // lib/tables.glsl
#endif
#endif

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

HW_FN float lut_1d(uint first, uint n, float x) {
  float p = clamp(x, 0.0f, 1.0f) * float(n - 1u);
  uint i = min(uint(p), n - 2u);
  float t = p - float(i);
  return mix(HW_LUT(first + i), HW_LUT(first + i + 1u), t);
}

// x runs fastest; both axes have n points.
HW_FN float lut_2d(uint first, uint n, float x, float y) {
  float p = clamp(y, 0.0f, 1.0f) * float(n - 1u);
  uint i = min(uint(p), n - 2u);
  float t = p - float(i);
  return mix(lut_1d(first + i * n, n, x), lut_1d(first + (i + 1u) * n, n, x), t);
}

HW_FN float lut_3d(uint first, uint n, float x, float y, float z) {
  float p = clamp(z, 0.0f, 1.0f) * float(n - 1u);
  uint i = min(uint(p), n - 2u);
  float t = p - float(i);
  return mix(lut_2d(first + i * n * n, n, x, y), lut_2d(first + (i + 1u) * n * n, n, x, y), t);
}

HW_NAMESPACE_END
#endif
