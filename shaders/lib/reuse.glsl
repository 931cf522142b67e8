// SPDX-License-Identifier: Apache-2.0
// What the stages of reuse share: their parameters, target values by light index.
#ifndef HW_REUSE_GLSL
#define HW_REUSE_GLSL
#include "wave.glsl"
#include "closures.h"
#include "light_choice.glsl"
#include "random.h"
#include "reservoir.h"
#include "reuse_target.h"
#include "words.glsl"

#define HW_REUSE HW_FRAME.reuse
layout(constant_id = 8) const uint HW_WEIGHTS = 0u;  // HW_REUSE_WEIGHTS_*: kernels hold one kind
bool reuse_has(uint flag) { return (HW_REUSE.flags & flag) != 0u; }

// Records by words (lib/words.glsl); the order is their members'.
Words proxy_words(uint light) { return Words(HW_REUSE.proxies + uint64_t(light) * HW_LIGHT_PROXY_BYTES); }
LightProxy proxy_load(uint light) {
  Words w = proxy_words(light);
  uint64_t w1 = w.at[1], w2 = w.at[2], w4 = w.at[4];
  LightProxy p;
  p.center = vec3(word_floats(w.at[0]), word_low_float(w1));
  p.radius = word_high_float(w1);
  p.axis = word_low(w2);
  p.emission = word_high(w2);
  vec2 w3 = word_floats(w.at[3]);
  p.intensity = w3.x;
  p.area = w3.y;
  p.inverse_choice = word_low_float(w4);
  p.flags = word_high(w4);
  p.threshold = 0.0;
  p.alias = 0u;
  return p;
}

Reservoir reservoir_load(uint64_t array, uint index) {
  Words w = Words(array + uint64_t(index) * HW_RESERVOIR_BYTES);
  uint64_t w0 = w.at[0];
  vec2 w1 = word_floats(w.at[1]), w2 = word_floats(w.at[2]);
  Reservoir r;
  r.light = word_low(w0);
  r.u = word_high_float(w0);
  r.v = w1.x;
  r.weight = w1.y;
  r.confidence = w2.x;
  r.target = w2.y;
  return r;
}
void reservoir_store(uint64_t array, uint index, Reservoir r) {
  Words w = Words(array + uint64_t(index) * HW_RESERVOIR_BYTES);
  w.at[0] = word_of(r.light, floatBitsToUint(r.u));
  w.at[1] = word_of(r.v, r.weight);
  w.at[2] = word_of(r.confidence, r.target);
}

ReuseSurface reuse_surface_load(uint64_t array, uint index) {
  Words w = Words(array + uint64_t(index) * HW_REUSE_SURFACE_BYTES);
  uint64_t w1 = w.at[1], w2 = w.at[2], w3 = w.at[3];
  ReuseSurface s;
  s.position = vec3(word_floats(w.at[0]), word_low_float(w1));
  s.key = word_high(w1);
  s.normal = word_low(w2);
  s.wo = word_high(w2);
  s.reflectance = word_low(w3);
  s.alpha_transmit = word_high(w3);
  return s;
}
void reuse_surface_store(uint64_t array, uint index, ReuseSurface s) {
  Words w = Words(array + uint64_t(index) * HW_REUSE_SURFACE_BYTES);
  w.at[0] = word_of(s.position.x, s.position.y);
  w.at[1] = word_of(floatBitsToUint(s.position.z), s.key);
  w.at[2] = word_of(s.normal, s.wo);
  w.at[3] = word_of(s.reflectance, s.alpha_transmit);
}

// How bright a point of a light is beside the light's mean, as far as p_hat counts it: by the map of a triangle's
// emission. `map`: 0 for none.
float reuse_point_brightness(uint map, vec2 uv) {
  if (!HW_HAS(HW_FEATURE_EMISSION_PROGRAM) || map == 0u) return 1.0;
  return emission_map_density(HW_ROOT.emission_maps, map, triangle_unwarp_area(uv));
}

// p_hat of a reservoir's sample at a surface; 0 for no light.
float reuse_target_of(TargetSurface s, Reservoir kept) {
  if (kept.light >= HW_ROOT.light_count) return 0.0;
  LightProxy light = proxy_load(kept.light);
  return target_value(s, light, HW_REUSE.light_mis_scale) *
         reuse_point_brightness(light.flags >> HW_PROXY_MAP_SHIFT, vec2(kept.u, kept.v));
}

// A reservoir of the last frame in this one: its light by this frame's index. The sample of a light that is gone is
// dropped; its confidence stays, as it stands for all that were looked at.
Reservoir reservoir_next_frame(Reservoir r) {
  if (r.light != HW_NONE && HW_REUSE.light_remap != 0ul) {
    uint now = r.light < HW_REUSE.light_remap_count ? Uints(HW_REUSE.light_remap).at[r.light] : HW_NONE;
    r.light = now;
    if (now == HW_NONE) r = reservoir_empty(r.confidence);
  }
  return r;
}
#endif
