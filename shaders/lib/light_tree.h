// SPDX-License-Identifier: Apache-2.0
// Choosing a light by a walk down the light tree (shared/light_tree.h), with odds by importance: an estimate of the
// irradiance that the lights below a node could bring to a surface (Conty Estevez and Kulla 2018, "Importance Sampling
// of Many Lights with Adaptive Tree Splitting", without trigonometry as in pbrt-v4). Bounds are conservative: a node is
// never of importance 0 where a light below it may contribute.
//
// Departures: the largest intensity stands for the power, so that spots and narrow area lamps weigh what they give
// those they shine on; two-sided emitters have a flag rather than all directions; lights at infinity have subtrees of
// their own, by irradiance; nodes hold the sphere about their box alone.
#ifndef HW_LIGHT_TREE_H
#define HW_LIGHT_TREE_H
#include "../shared/light_tree.h"
#include "frame.h"
#include "packed_float.h"
#include "sampler.h"
#ifdef __cplusplus
#define HW_LIGHT_TREE_UINT(ADDRESS, INDEX) (reinterpret_cast<const uint*>(ADDRESS)[INDEX])
#else
#include "words.glsl"
#define HW_LIGHT_TREE_UINT(ADDRESS, INDEX) uint_at(ADDRESS, INDEX)
#endif
HW_NAMESPACE_BEGIN

// The tables of one tree, by address.
struct LightTreeTables {
  uint64_t nodes;     // LightTreeNode[]
  uint64_t leaves;    // LightTreeBounds[]: of the light at a position
  uint64_t order;     // uint[]: light at a position
  uint64_t position;  // uint[lights]: HW_NONE for lights that can't be chosen
  LightTreeScale scale;
};

// Who asks: a point, the unit normal on the side light must come from, and whether that does not matter, since light
// may pass through.
struct LightTreeReceiver {
  vec3 position;
  vec3 normal;
  bool transmits;
};

#ifdef __cplusplus
inline LightTreeBounds light_tree_bounds(uint64_t nodes, uint i) {
  return reinterpret_cast<const LightTreeNode*>(nodes)[i].bounds;
}
inline LightTreeBounds light_tree_leaf(uint64_t leaves, uint position) {
  return reinterpret_cast<const LightTreeBounds*>(leaves)[position];
}
// As the node has them (LightTreeNode).
inline uvec2 light_tree_packed_links(uint64_t nodes, uint i) {
  const LightTreeNode& n = reinterpret_cast<const LightTreeNode*>(nodes)[i];
  return {n.child, n.middle};
}
#else
// By words (lib/words.glsl): the order is LightTreeNode's.
LightTreeBounds light_tree_bounds_of(uint64_t w0, uint64_t w1) {
  return LightTreeBounds(word_low(w0), word_high(w0), word_low(w1), word_high(w1));
}
LightTreeBounds light_tree_bounds(uint64_t nodes, uint i) {
  uint64_t w = nodes + uint64_t(i) * HW_LIGHT_TREE_NODE_BYTES;
  return light_tree_bounds_of(word_at(w, 0u), word_at(w, 1u));
}
LightTreeBounds light_tree_leaf(uint64_t leaves, uint position) {
  uint64_t w = leaves + uint64_t(position) * HW_LIGHT_TREE_BOUNDS_BYTES;
  return light_tree_bounds_of(word_at(w, 0u), word_at(w, 1u));
}
uvec2 light_tree_packed_links(uint64_t nodes, uint i) {
  uint64_t w = word_at(nodes + uint64_t(i) * HW_LIGHT_TREE_NODE_BYTES, 2u);
  return uvec2(word_low(w), word_high(w));
}
#endif
// Left child, HW_NONE of a leaf, and first position of the right one.
HW_FN uvec2 light_tree_unpack_links(uvec2 packed) {
  return packed.x == HW_NONE ? packed : uvec2(packed.x & HW_LIGHT_TREE_LINK, packed.y & HW_LIGHT_TREE_LINK);
}
HW_FN uvec2 light_tree_links(uint64_t nodes, uint i) {
  return light_tree_unpack_links(light_tree_packed_links(nodes, i));
}
// Lights below a node over few, 1 of others; the first one's position, of a leaf and of a node over few.
HW_FN uint light_tree_few(uvec2 packed) {
  return packed.x == HW_NONE ? 1u : (packed.x >> HW_LIGHT_TREE_LINK_BITS) + 1u;
}
HW_FN uint light_tree_few_first(uvec2 packed) {
  return packed.x == HW_NONE ? packed.y : (packed.y & HW_LIGHT_TREE_LINK) - (packed.y >> HW_LIGHT_TREE_LINK_BITS);
}

// The scale of directions, in the place of distant nodes.
HW_CONST float HW_LIGHT_TREE_PLACES = 2097151.0f;  // steps of a place along an axis: 2^21 - 1

// The middle of the sphere; distant: nearly the unit direction.
HW_FN vec3 light_tree_middle(HW_IN(LightTreeBounds) b, HW_IN(LightTreeScale) scale) {
  vec3 at = vec3(float(b.place_low & 0x1FFFFFu), float((b.place_low >> 21u) | ((b.place_high & 0x3FFu) << 11u)),
                 float((b.place_high >> 10u) & 0x1FFFFFu));
  bool distant = (b.strength & HW_LIGHT_TREE_DISTANT) != 0u;
  return distant ? at * (2.0f / HW_LIGHT_TREE_PLACES) - vec3(1.0f) : scale.corner + at * scale.step;
}
HW_FN float light_tree_power(HW_IN(LightTreeBounds) b) { return upper_float_low(b.strength & 0x7FFFu); }
// The same bounds of another power, above 0; light_tree_power gives it back rounded, never as 0.
HW_FN LightTreeBounds light_tree_with_power(LightTreeBounds b, float power) {
  b.strength = (b.strength & ~0x7FFFu) | max(upper_float_near(power), 1u);
  return b;
}
HW_FN float light_tree_radius(HW_IN(LightTreeBounds) b) { return upper_float_high(b.strength); }
HW_FN vec3 light_tree_axis(HW_IN(LightTreeBounds) b) {
  return octahedral_direction(vec2(float(b.cone & 0xFFu), float((b.cone >> 8u) & 0xFFu)) * (1.0f / 127.5f) -
                              vec2(1.0f));
}

// Below this cosine light arrives or leaves at no angle that counts; bounds are widened by as much, so that rounding
// (of normals to 32 bits, of boxes) excludes no light.
HW_CONST float HW_LIGHT_TREE_SLACK = 1e-3f;

// cos of max(a - b, 0) for angles in [0, pi].
HW_FN float light_tree_cos_less(float cos_a, float sin_a, float cos_b, float sin_b) {
  return cos_a > cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
}

// Estimate of what the lights within `n` give the receiver, in the tree's unit: 0 where none of them gives anything,
// else in [1e-30, 1e30].
HW_FN float light_tree_importance(HW_IN(LightTreeBounds) n, HW_IN(LightTreeReceiver) r, HW_IN(LightTreeScale) scale) {
  bool distant = (n.strength & HW_LIGHT_TREE_DISTANT) != 0u;
  vec2 sines = vec2(float((n.cone >> 16u) & 0xFFu), float(n.cone >> 24u)) * (1.0f / 255.0f);
  vec2 heights = sines * sines;  // (1 - cos) / 2
  float cos_o = 1.0f - 2.0f * heights.x;
  float sin_o = 2.0f * sines.x * safe_sqrt(1.0f - heights.x);
  vec3 to_middle = light_tree_middle(n, scale) - (distant ? vec3(0.0f) : r.position);
  float radius = light_tree_radius(n);
  float r2 = radius * radius;
  float d2 = dot(to_middle, to_middle);
  vec3 wi = to_middle * inversesqrt(max(d2, 1e-36f));
  // The cone of directions towards the sphere; towards distant lights.
  bool outside = d2 > r2;
  float sin2_u = outside ? r2 / d2 : 0.0f;
  float cos_u = distant ? cos_o : (outside ? sqrt(max(1.0f - sin2_u, 0.0f)) : -1.0f);
  float sin_u = distant ? sin_o : sqrt(sin2_u);

  float cos_i = clamp(dot(r.normal, wi), -1.0f, 1.0f);
  float arrives = light_tree_cos_less(cos_i, safe_sqrt(1.0f - cos_i * cos_i), cos_u, sin_u);
  arrives = r.transmits ? 1.0f : arrives;

  float cos_e = clamp(-dot(light_tree_axis(n), wi), -1.0f, 1.0f);
  cos_e = (n.place_high & HW_LIGHT_TREE_TWO_SIDED) != 0u ? abs(cos_e) : cos_e;
  float sin_e = safe_sqrt(1.0f - cos_e * cos_e);
  bool in_cone = cos_e > cos_o;
  float cos_1 = in_cone ? 1.0f : cos_e * cos_o + sin_e * sin_o;
  float sin_1 = in_cone ? 0.0f : max(sin_e * cos_o - cos_e * sin_o, 0.0f);
  float leaves = light_tree_cos_less(cos_1, sin_1, cos_u, sin_u);
  leaves = distant ? 1.0f : (leaves < 1.0f - 2.0f * heights.y - HW_LIGHT_TREE_SLACK ? -1.0f : max(leaves, 0.0f));

  if (arrives < -HW_LIGHT_TREE_SLACK || leaves < 0.0f) {
    return 0.0f;
  }
  float falloff = distant ? 1.0f : 1.0f / max(max(d2, r2), 1e-12f);
  float value = light_tree_power(n) * max(arrives, HW_LIGHT_TREE_SLACK) * max(leaves, HW_LIGHT_TREE_SLACK) * falloff;
  return clamp(value, 1e-30f, 1e30f);
}

// The chance of going to the first of two siblings; below 0 where neither can contribute.
HW_FN float light_tree_first_chance(HW_IN(LightTreeTables) tree, uint child, HW_IN(LightTreeReceiver) r) {
  float first = light_tree_importance(light_tree_bounds(tree.nodes, child), r, tree.scale);
  float second = light_tree_importance(light_tree_bounds(tree.nodes, child + 1u), r, tree.scale);
  float sum = first + second;
  if (!(sum > 0.0f)) {
    return -1.0f;
  }
  // Neither is left without any chance that a random number could give it.
  float chance = clamp(first / sum, 1e-6f, 1.0f - 1e-6f);
  return first > 0.0f ? (second > 0.0f ? chance : 1.0f) : 0.0f;
}

// Uses what u in [0, 1) has chosen with the chance `taken`: `at` is where it lies in it, `grain` the step of the values
// it can have. Each choice stretches u; where its 24 bits run out, hashed ones come behind them.
HW_FN float light_tree_stretch(float at, float taken, HW_INOUT(float) grain, HW_INOUT(uint) hash) {
  grain /= taken;
  if (grain > 2.44140625e-4f) {
    hash = sampler_hash(hash);
    at += grain * sampler_to_float(hash);
    grain = 5.9604644775390625e-8f;
  }
  return clamp(at, 0.0f, 0.99999994f);
}

// The part of the chances of few lights that is by the square root of their importance, for importance knows neither
// which way a surface reflects nor what is in shadow. Not the same for all: lights that hardly shine would get it too.
// Measured: docs/measurements/light_tree.md.
HW_CONST float HW_LIGHT_TREE_EVEN = 1.0f;

// Chances of few lights, times their sum. Of the first four, of the others: registers, which arrays would not be.
struct LightTreeShares {
  vec4 low, high;
  float all;
};
HW_FN vec4 light_tree_put(vec4 v, uint i, float to) {
  return vec4(i == 0u ? to : v.x, i == 1u ? to : v.y, i == 2u ? to : v.z, i == 3u ? to : v.w);
}
HW_FN float light_tree_sum(vec4 low, vec4 high) { return dot(low + high, vec4(1.0f)); }
HW_FN float light_tree_share(HW_IN(LightTreeShares) s, uint i) {
  vec4 v = i < 4u ? s.low : s.high;
  uint k = i & 3u;
  return k == 0u ? v.x : (k == 1u ? v.y : (k == 2u ? v.z : v.w));
}

// Of the `count` lights from position `first` on.
HW_FN LightTreeShares light_tree_shares(HW_IN(LightTreeTables) tree, uint first, uint count,
                                        HW_IN(LightTreeReceiver) r) {
  LightTreeShares s;
  s.low = s.high = vec4(0.0f);
  for (uint i = 0u; i < count; ++i) {
    float own = light_tree_importance(light_tree_leaf(tree.leaves, first + i), r, tree.scale);
    s.low = light_tree_put(s.low, i, own);
    s.high = light_tree_put(s.high, i - 4u, own);
  }
  vec4 low = sqrt(s.low);
  vec4 high = sqrt(s.high);
  float even = HW_LIGHT_TREE_EVEN * light_tree_sum(s.low, s.high) / max(light_tree_sum(low, high), 1e-30f);
  s.low = s.low + low * even;
  s.high = s.high + high * even;
  s.all = light_tree_sum(s.low, s.high);
  return s;
}

// In both walks `child` is a node also where there is none: what is the same for all paths, drivers load whether or not
// any of them is still in the loop (Mesa 26.2's lavapipe: the chance of the world, a tree of one light).

// Draws a light below `node` with u in [0, 1): its index, and the chance of it, given the node. HW_NONE with pdf 0: no
// light below can contribute. u is left uniform, to be used again.
HW_FN uint light_tree_draw(HW_IN(LightTreeTables) tree, uint node, HW_IN(LightTreeReceiver) r, HW_INOUT(float) u,
                           HW_OUT(float) pdf) {
  uvec2 links = light_tree_packed_links(tree.nodes, node);
  pdf = 1.0f;
  float grain = 5.9604644775390625e-8f;
  uint hash = floatBitsToUint(u) ^
              sampler_hash(floatBitsToUint(r.position.x) ^
                           sampler_hash(floatBitsToUint(r.position.y) ^ sampler_hash(floatBitsToUint(r.position.z))));
  // A leaf's child has bits above the link.
  bool many = links.x <= HW_LIGHT_TREE_LINK;
  uint child = many ? links.x : node;
  while (many) {
    float chance = light_tree_first_chance(tree, child, r);
    if (chance < 0.0f) {
      pdf = 0.0f;
      return HW_NONE;
    }
    bool left = u < chance;
    float taken = left ? chance : 1.0f - chance;
    u = light_tree_stretch((left ? u : u - chance) / taken, taken, grain, hash);
    pdf *= taken;
    links = light_tree_packed_links(tree.nodes, left ? child : child + 1u);
    many = links.x <= HW_LIGHT_TREE_LINK;
    child = many ? links.x : child;
  }
  uint first = light_tree_few_first(links);
  uint count = light_tree_few(links);
  if (count == 1u) return HW_LIGHT_TREE_UINT(tree.order, first);
  // Few lights: each by its own importance.
  LightTreeShares shares = light_tree_shares(tree, first, count, r);
  if (!(shares.all > 0.0f)) {
    pdf = 0.0f;
    return HW_NONE;
  }
  float at = u * shares.all;
  float upto = 0.0f, below = 0.0f, own = 0.0f;
  uint chosen = 0u;
  for (uint i = 0u; i < HW_LIGHT_TREE_FEW; ++i) {
    float share = light_tree_share(shares, i);
    // The last one that has any takes what rounding leaves.
    bool takes = share > 0.0f && (own <= 0.0f || at >= upto);
    chosen = takes ? i : chosen;
    below = takes ? upto : below;
    own = takes ? share : own;
    upto += share;
  }
  float taken = own / shares.all;
  u = light_tree_stretch((at - below) / own, taken, grain, hash);
  pdf *= taken;
  return HW_LIGHT_TREE_UINT(tree.order, first + chosen);
}

// The chance with which light_tree_draw gives `light`, which is below `node`: the same numbers in the same order. 0 for
// a light that can't be chosen.
HW_FN float light_tree_chance(HW_IN(LightTreeTables) tree, uint node, uint light, HW_IN(LightTreeReceiver) r) {
  uint position = HW_LIGHT_TREE_UINT(tree.position, light);
  if (position == HW_NONE) {
    return 0.0f;
  }
  uvec2 links = light_tree_packed_links(tree.nodes, node);
  bool many = links.x <= HW_LIGHT_TREE_LINK;
  uint child = many ? links.x : node;
  float pdf = 1.0f;
  while (many && pdf > 0.0f) {
    float chance = light_tree_first_chance(tree, child, r);
    bool left = position < links.y;
    float taken = left ? chance : 1.0f - chance;
    pdf *= chance < 0.0f ? 0.0f : taken;
    links = light_tree_packed_links(tree.nodes, left ? child : child + 1u);
    many = links.x <= HW_LIGHT_TREE_LINK;
    child = many ? links.x : child;
  }
  uint first = light_tree_few_first(links);
  uint count = light_tree_few(links);
  if (count == 1u || !(pdf > 0.0f)) return pdf;
  LightTreeShares shares = light_tree_shares(tree, first, count, r);
  return shares.all > 0.0f ? pdf * (light_tree_share(shares, position - first) / shares.all) : 0.0f;
}

HW_NAMESPACE_END
#endif
