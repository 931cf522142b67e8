// SPDX-License-Identifier: Apache-2.0
// Hashes behind procedural textures. Lookup3: R. Jenkins 2006, final and mix steps, seeded by the number of words;
// PCG: Jarzynski and Olano 2020, "Hash functions for GPU rendering", on signed words with the sign cleared, as
// Blender's Voronoi texture uses it.
#ifndef HW_HASH_H
#define HW_HASH_H
#include "../shared/portable.h"
#ifdef __cplusplus
namespace hw {
using glm::ivec4;
using glm::uvec4;
}  // namespace hw
#endif
HW_NAMESPACE_BEGIN

HW_FN uint rotate_left(uint x, uint k) { return (x << k) | (x >> (32u - k)); }

// Lookup3 of the first `words` (1 to 4) words.
HW_FN uint lookup3(uint x, uint y, uint z, uint w, uint words) {
  uint a = 0xdeadbeefu + (words << 2u) + 13u;
  uint b = a + (words >= 2u ? y : 0u);
  uint c = a + (words >= 3u ? z : 0u);
  a += x;
  if (words == 4u) {
    a -= c;
    a ^= rotate_left(c, 4u);
    c += b;
    b -= a;
    b ^= rotate_left(a, 6u);
    a += c;
    c -= b;
    c ^= rotate_left(b, 8u);
    b += a;
    a -= c;
    a ^= rotate_left(c, 16u);
    c += b;
    b -= a;
    b ^= rotate_left(a, 19u);
    a += c;
    c -= b;
    c ^= rotate_left(b, 4u);
    b += a;
    a += w;
  }
  c ^= b;
  c -= rotate_left(b, 14u);
  a ^= c;
  a -= rotate_left(c, 11u);
  b ^= a;
  b -= rotate_left(a, 25u);
  c ^= b;
  c -= rotate_left(b, 16u);
  a ^= c;
  a -= rotate_left(c, 4u);
  b ^= a;
  b -= rotate_left(a, 14u);
  c ^= b;
  c -= rotate_left(b, 24u);
  return c;
}

// 0..1, both ends included.
HW_FN float unit_float(uint x) { return float(x) * (1.0f / 4294967295.0f); }
HW_FN float hash_floats(float x, float y, float z, float w, uint words) {
  return unit_float(lookup3(floatBitsToUint(x), floatBitsToUint(y), floatBitsToUint(z), floatBitsToUint(w), words));
}

// PCG of 2, 3 or 4 words; each result in 0..1, unused ones 0.
HW_FN vec4 pcg_unit(ivec4 cell, uint words) {
  const uint m = 1664525u;
  const uint inc = 1013904223u;
  uint x = uint(cell.x) * m + inc;
  uint y = uint(cell.y) * m + inc;
  uint z = uint(cell.z) * m + inc;
  uint w = uint(cell.w) * m + inc;
  for (int round = 0; round < 2; ++round) {
    if (words == 2u) {
      x += y * m;
      y += x * m;
    } else {
      x += y * (words == 4u ? w : z);
      y += z * x;
      z += x * y;
      w += y * z;
    }
    if (round == 0) {  // arithmetic shift
      x ^= uint(int(x) >> 16);
      y ^= uint(int(y) >> 16);
      z ^= uint(int(z) >> 16);
      w ^= uint(int(w) >> 16);
    }
  }
  const float scale = 1.0f / 2147483647.0f;
  return vec4(float(x & 0x7FFFFFFFu), float(y & 0x7FFFFFFFu), words > 2u ? float(z & 0x7FFFFFFFu) : 0.0f,
              words > 3u ? float(w & 0x7FFFFFFFu) : 0.0f) *
         scale;
}

HW_NAMESPACE_END
#endif
