// SPDX-License-Identifier: Apache-2.0
// The list of closures at a hit. In GLSL it is a window on memory (Closure[HW_MAX_CLOSURES] at an address of the path),
// so that passing it costs a few words; in C++ it owns its records.
#ifndef HW_CLOSURE_LIST_H
#define HW_CLOSURE_LIST_H
#include "../shared/closure.h"
#include "../shared/features.h"
HW_NAMESPACE_BEGIN

// Closures whose mean weight is below this are dropped when they are added (Cycles' cutoff).
HW_CONST float HW_CLOSURE_WEIGHT_CUTOFF = 1e-5f;

#ifdef __cplusplus
struct ClosureList {
  Closure at[HW_MAX_CLOSURES];
  uint count = 0;
  vec3 transparent = vec3(0.0f);
};
#define HW_CLOSURE_AT(list, i) (list).at[i]
#else
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ClosureArray { Closure at[]; };
struct ClosureList {
  uint64_t base;     // ClosureArray of this path
  uint count;        // records written; to be kept beside them for later stages
  vec3 transparent;  // weight of what goes straight through; becomes a record in closures_finish
};
#define HW_CLOSURE_AT(list, i) (ClosureArray((list).base).at[i])

// An empty list to build, or one that an earlier stage has filled with `count` records.
ClosureList closures_at(uint64_t address, uint count) {
  ClosureList list;
  list.base = address;
  list.count = count;
  list.transparent = vec3(0.0f);
  return list;
}
#endif

// Appends `c` unless it weighs next to nothing (or is not finite) or the list is full. The last record is kept for
// transparency, so HW_MAX_CLOSURES - 1 others fit; more are dropped, as in Cycles.
HW_FN void closures_push(HW_INOUT(ClosureList) list, HW_IN(Closure) c) {
  if (c.sample_weight > 0.0f && list.count < HW_MAX_CLOSURES - 1u) {
    HW_CLOSURE_AT(list, list.count) = c;
    list.count += 1u;
  }
}

// To be called once after the last builder: writes the transparent record.
HW_FN void closures_finish(HW_INOUT(ClosureList) list) {
  if (HW_HAS(HW_FEATURE_TRANSPARENT)) {
    float mean = (list.transparent.x + list.transparent.y + list.transparent.z) * (1.0f / 3.0f);
    if (mean >= HW_CLOSURE_WEIGHT_CUTOFF) {
      Closure c;
      c.type = HW_CLOSURE_TRANSPARENT;
      c.weight = list.transparent;
      c.sample_weight = mean;
      c.N = vec3(0.0f, 0.0f, 1.0f);
      c.alpha_x = 0.0f;
      c.alpha_y = 0.0f;
      c.ior = 1.0f;
      c.energy_scale = 1.0f;
      c.tangent = 0u;
      c.color0_rg = 0u;
      c.color0_b_color1_r = 0u;
      c.color1_gb = 0u;
      HW_CLOSURE_AT(list, list.count) = c;
      list.count += 1u;
    }
  }
}

HW_NAMESPACE_END
#endif
