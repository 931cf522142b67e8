// SPDX-License-Identifier: Apache-2.0
// The list of closures at a hit. In GLSL it is a window on memory (Closure[HW_MAX_CLOSURES] at an address of the path),
// so that passing it costs a few words; in C++ it owns its records. Records are copied out and in whole.
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
HW_FN Closure closure_load(const ClosureList& list, uint i) { return list.at[i]; }
HW_FN float closure_sample_weight(const ClosureList& list, uint i) { return list.at[i].sample_weight; }
HW_FN void closure_store(ClosureList& list, uint i, const Closure& c) { list.at[i] = c; }
#else
#include "words.glsl"
struct ClosureList {
  uint64_t base;     // Closure[HW_MAX_CLOSURES] of this path
  uint count;        // records written; to be kept beside them for later stages
  vec3 transparent;  // weight of what goes straight through; becomes a record in closures_finish
};
// An empty list to build, or one that an earlier stage has filled with `count` records.
ClosureList closures_at(uint64_t address, uint count) {
  ClosureList list;
  list.base = address;
  list.count = count;
  list.transparent = vec3(0.0f);
  return list;
}

// What no closure of the scene has is neither written nor read.
#define HW_CLOSURE_HAS_SHAPE \
  HW_HAS(HW_FEATURE_MICROFACET | HW_FEATURE_ROUGH_DIFFUSE | HW_FEATURE_SHEEN | HW_FEATURE_TOON)
#define HW_CLOSURE_HAS_COLOR1 HW_HAS(HW_FEATURE_METALLIC | HW_FEATURE_CONDUCTOR | HW_FEATURE_TRANSMISSION)

#ifdef HW_CLOSURES_KEPT
#define HW_CLOSURE_WORD(ADDRESS, INDEX) word_at(ADDRESS, INDEX)
#else
#define HW_CLOSURE_WORD(ADDRESS, INDEX) (Words(ADDRESS).at[INDEX])
#endif
uint64_t closure_address(ClosureList list, uint i) { return list.base + uint64_t(i * HW_CLOSURE_BYTES); }

Closure closure_load(ClosureList list, uint i) {
  uint64_t w = closure_address(list, i);
  uint64_t w0 = HW_CLOSURE_WORD(w, 0u), w1 = HW_CLOSURE_WORD(w, 1u), w2 = HW_CLOSURE_WORD(w, 2u),
           w3 = HW_CLOSURE_WORD(w, 3u);
  Closure c;
  c.type = word_low(w0);
  c.weight = vec3(word_high_float(w0), word_floats(w1));
  c.sample_weight = word_low_float(w2);
  c.N = vec3(word_high_float(w2), word_floats(w3));
  c.alpha_x = 1.0;
  c.alpha_y = 1.0;
  c.ior = 1.0;
  c.energy_scale = 1.0;
  c.color0_rg = 0u;
  c.color0_b_color1_r = 0u;
  c.color1_gb = 0u;
  c.tangent = 0u;
  if (HW_CLOSURE_HAS_SHAPE) {
    uint64_t w4 = HW_CLOSURE_WORD(w, 4u);
    c.alpha_x = word_low_float(w4);
    c.alpha_y = word_high_float(w4);
  }
  if (HW_HAS(HW_FEATURE_MICROFACET)) {
    uint64_t w5 = HW_CLOSURE_WORD(w, 5u);
    c.ior = word_low_float(w5);
    c.energy_scale = word_high_float(w5);
  }
  if (HW_HAS(HW_FEATURE_MICROFACET | HW_FEATURE_ROUGH_DIFFUSE)) {
    uint64_t w6 = HW_CLOSURE_WORD(w, 6u);
    c.color0_rg = word_low(w6);
    c.color0_b_color1_r = word_high(w6);
  }
  if (HW_CLOSURE_HAS_COLOR1 || HW_HAS(HW_FEATURE_ANISOTROPY)) {
    uint64_t w7 = HW_CLOSURE_WORD(w, 7u);
    c.color1_gb = word_low(w7);
    c.tangent = word_high(w7);
  }
  return c;
}

float closure_sample_weight(ClosureList list, uint i) {
  return word_low_float(HW_CLOSURE_WORD(closure_address(list, i), 2u));
}

void closure_store(ClosureList list, uint i, Closure c) {
  Words w = Words(closure_address(list, i));
  w.at[0] = word_of(c.type, floatBitsToUint(c.weight.x));
  w.at[1] = word_of(c.weight.y, c.weight.z);
  w.at[2] = word_of(c.sample_weight, c.N.x);
  w.at[3] = word_of(c.N.y, c.N.z);
  if (HW_CLOSURE_HAS_SHAPE) w.at[4] = word_of(c.alpha_x, c.alpha_y);
  if (HW_HAS(HW_FEATURE_MICROFACET)) w.at[5] = word_of(c.ior, c.energy_scale);
  if (HW_HAS(HW_FEATURE_MICROFACET | HW_FEATURE_ROUGH_DIFFUSE)) w.at[6] = word_of(c.color0_rg, c.color0_b_color1_r);
  if (HW_CLOSURE_HAS_COLOR1 || HW_HAS(HW_FEATURE_ANISOTROPY)) w.at[7] = word_of(c.color1_gb, c.tangent);
}

// Filter Glossy's change of a record alone.
void closure_store_roughness(ClosureList list, uint i, Closure c) {
  if (HW_CLOSURE_HAS_SHAPE) Words(closure_address(list, i)).at[4] = word_of(c.alpha_x, c.alpha_y);
}
#endif

// Appends `c` unless it weighs next to nothing (or is not finite) or the list is full. The last record is kept for
// transparency, so HW_MAX_CLOSURES - 1 others fit; more are dropped, as in Cycles.
HW_FN void closures_push(HW_INOUT(ClosureList) list, HW_IN(Closure) c) {
  if (c.sample_weight > 0.0f && list.count < HW_MAX_CLOSURES - 1u) {
    closure_store(list, list.count, c);
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
      closure_store(list, list.count, c);
      list.count += 1u;
    }
  }
}

HW_NAMESPACE_END
#endif
