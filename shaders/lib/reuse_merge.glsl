// SPDX-License-Identifier: Apache-2.0
// Merges a surface's canonical sample with reservoirs that other surfaces made, by MIS weights that sum to one
// (lib/reservoir.h): what every unbiased estimator of reuse does, wherever it keeps its reservoirs. Unbiased because the
// canonical sample can be any light's any point, and because each reservoir's W is an unbiased contribution weight for
// the p_hat of its own surface. Visibility is in no p_hat: the kept sample's is asked for when it is shaded.
//
// The includer defines, before this: Reservoir merge_sample(uint id) and ReuseSurface merge_surface(uint id).
#ifndef HW_REUSE_MERGE_GLSL
#define HW_REUSE_MERGE_GLSL
#include "reuse.glsl"

// What takes part, chosen by surfaces and counts, never by samples.
const uint HW_MERGE_MOST = 65u;
uint hw_merge_ids[HW_MERGE_MOST];
uint hw_merge_count = 0u;

void merge_take(uint id) {
  if (hw_merge_count < HW_MERGE_MOST) hw_merge_ids[hw_merge_count++] = id;
}

Reservoir merge_capped(uint id) { return reservoir_capped(merge_sample(id), HW_REUSE.confidence_cap); }

// p_hat of a sample at the surface of what was taken.
float merge_target(uint id, Reservoir r) { return reuse_target_of(target_surface(merge_surface(id)), r); }

// The sum of c p_hat(r) over what was taken, but for number `without`.
float merge_others(Reservoir r, uint without) {
  float sum = 0.0;
  for (uint j = 0u; j < hw_merge_count; ++j)
    if (j != without) sum += merge_capped(hw_merge_ids[j]).confidence * merge_target(hw_merge_ids[j], r);
  return sum;
}

Reservoir merge_unbiased(Reservoir canonical, TargetSurface surface, inout uint random) {
  float c_1 = canonical.confidence;
  float c_all = c_1;
  for (uint i = 0u; i < hw_merge_count; ++i) c_all += merge_capped(hw_merge_ids[i]).confidence;
  float canonical_here = reuse_target_of(surface, canonical);
  float m_1 = mis_pairwise_base(c_1, c_all);
  ReservoirStream stream = stream_begin();
  for (uint i = 0u; i < hw_merge_count; ++i) {
    Reservoir r = merge_capped(hw_merge_ids[i]);
    float here = reuse_target_of(surface, r);
    float m = 0.0;
    if (HW_WEIGHTS == HW_REUSE_WEIGHTS_BALANCE) {
      float own = merge_target(hw_merge_ids[i], r);
      m = mis_balance(r.confidence, own, c_1 * here + merge_others(r, i));
    } else {
      TargetSurface there = target_surface(merge_surface(hw_merge_ids[i]));
      m = mis_pairwise(r.confidence, c_1, c_all, reuse_target_of(there, r), here);
      m_1 += mis_pairwise_canonical(r.confidence, c_1, c_all, reuse_target_of(there, canonical), canonical_here);
    }
    stream_add(stream, r.light, r.u, r.v, stream_weight(r, here) * m, here, r.confidence, random_next(random));
  }
  if (HW_WEIGHTS == HW_REUSE_WEIGHTS_BALANCE)
    m_1 = mis_balance(c_1, canonical_here, merge_others(canonical, HW_NONE));
  stream_add(stream, canonical.light, canonical.u, canonical.v, stream_weight(canonical, canonical_here) * m_1,
             canonical_here, c_1, random_next(random));
  return stream_end_mis(stream);
}
#endif
