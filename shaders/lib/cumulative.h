// SPDX-License-Identifier: Apache-2.0
// Reading cumulative distributions: floats that begin with 0, never fall and end in 1 (core/lights/cumulative.h).
#ifndef HW_CUMULATIVE_H
#define HW_CUMULATIVE_H
#include "../shared/portable.h"
#ifdef __cplusplus
#define HW_CUMULATIVE(ADDRESS, INDEX) (reinterpret_cast<const float*>(ADDRESS)[INDEX])
#else
#include "words.glsl"
#define HW_CUMULATIVE(ADDRESS, INDEX) float_at(ADDRESS, INDEX)
#endif
HW_NAMESPACE_BEGIN

// Largest i < count with cdf[first + i] <= u; cells of probability 0 are never chosen.
HW_FN uint cumulative_find(uint64_t cdf, uint first, uint count, float u) {
  uint low = 0u;
  uint n = count;
  while (n > 1u) {
    uint half_n = n >> 1u;
    bool right = HW_CUMULATIVE(cdf, first + low + half_n) <= u;
    low = right ? low + half_n : low;
    n = right ? n - half_n : half_n;
  }
  return low;
}

HW_NAMESPACE_END
#endif
