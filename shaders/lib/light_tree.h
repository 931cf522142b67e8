// SPDX-License-Identifier: Apache-2.0
// Choosing a light by a walk down the light tree (shared/light_tree.h), with odds by importance: an estimate of the
// irradiance that the lights below a node could bring to a surface (Conty Estevez and Kulla 2018, "Importance Sampling
// of Many Lights with Adaptive Tree Splitting", without trigonometry as in pbrt-v4). Bounds are conservative: a node is
// never of importance 0 where a light below it may contribute.
//
// Departures: the largest intensity stands for the power, so that spots and narrow area lamps weigh what they give
// those they shine on; two-sided emitters have a flag rather than all directions; lights at infinity have subtrees of
// their own, by irradiance; what is wholly below the horizon is found by the box, not by its sphere.
#ifndef HW_LIGHT_TREE_H
#define HW_LIGHT_TREE_H
#include "../shared/light_tree.h"
#include "frame.h"
#include "sampler.h"
#ifdef __cplusplus
#define HW_LIGHT_TREE_UINT(ADDRESS, INDEX) (reinterpret_cast<const uint*>(ADDRESS)[INDEX])
#else
#include "words.glsl"
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightTreeUints { uint at[]; };
#define HW_LIGHT_TREE_UINT(ADDRESS, INDEX) (LightTreeUints(ADDRESS).at[INDEX])
#endif
HW_NAMESPACE_BEGIN

// The tables of one tree, by address.
struct LightTreeTables {
  uint64_t nodes;     // LightTreeNode[]
  uint64_t order;     // uint[]: light at a position
  uint64_t position;  // uint[lights]: HW_NONE for lights that can't be chosen
};

// Who asks: a point, the unit normal on the side light must come from, and whether that does not matter, since light
// may pass through.
struct LightTreeReceiver {
  vec3 position;
  vec3 normal;
  bool transmits;
};

#ifdef __cplusplus
inline LightTreeNode light_tree_load(uint64_t nodes, uint i) {
  return reinterpret_cast<const LightTreeNode*>(nodes)[i];
}
#else
// By words (lib/words.glsl): the order is LightTreeNode's.
LightTreeNode light_tree_load(uint64_t nodes, uint i) {
  Words w = Words(nodes + uint64_t(i) * HW_LIGHT_TREE_NODE_BYTES);
  uint64_t w3 = w.at[3], w4 = w.at[4], w5 = w.at[5];
  LightTreeNode n;
  words_to_vectors(w.at[0], w.at[1], w.at[2], n.low, n.high);
  n.axis = word_low(w3);
  n.cone = word_high(w3);
  n.power = word_low_float(w4);
  n.first = word_high(w4);
  n.count = word_low(w5);
  n.child = word_high(w5);
  return n;
}
#endif

// Below this cosine light arrives or leaves at no angle that counts; bounds are widened by as much, so that rounding
// (of normals to 32 bits, of boxes) excludes no light.
HW_CONST float HW_LIGHT_TREE_SLACK = 1e-3f;

// cos of max(a - b, 0) for angles in [0, pi].
HW_FN float light_tree_cos_less(float cos_a, float sin_a, float cos_b, float sin_b) {
  return cos_a > cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
}

// Estimate of what the lights below `n` give the receiver, in the tree's unit: 0 where none of them gives anything,
// else in [1e-30, 1e30].
HW_FN float light_tree_importance(HW_IN(LightTreeNode) n, HW_IN(LightTreeReceiver) r) {
  bool distant = (n.cone & HW_LIGHT_TREE_DISTANT) != 0u;
  vec2 heights = min(unpackHalf2x16(n.cone & 0x7FFF7FFFu), vec2(1.0f));
  float cos_o = 1.0f - 2.0f * heights.x;
  float sin_o = 2.0f * safe_sqrt(heights.x * (1.0f - heights.x));
  vec3 extent = (n.high - n.low) * 0.5f;
  vec3 to_middle = n.low + extent - (distant ? vec3(0.0f) : r.position);
  float r2 = dot(extent, extent);
  float d2 = dot(to_middle, to_middle);
  vec3 wi = to_middle * inversesqrt(max(d2, 1e-36f));
  // The cone of directions towards the box, by the sphere about it; towards distant lights.
  bool outside = d2 > r2;
  float sin2_u = outside ? r2 / d2 : 0.0f;
  float cos_u = distant ? cos_o : (outside ? sqrt(max(1.0f - sin2_u, 0.0f)) : -1.0f);
  float sin_u = distant ? sin_o : sqrt(sin2_u);

  float cos_i = clamp(dot(r.normal, wi), -1.0f, 1.0f);
  float arrives = light_tree_cos_less(cos_i, safe_sqrt(1.0f - cos_i * cos_i), cos_u, sin_u);
  float height = dot(r.normal, to_middle) + dot(abs(r.normal), extent);  // of the box's highest corner
  bool below = !distant && height * height > HW_LIGHT_TREE_SLACK * HW_LIGHT_TREE_SLACK * d2 && height < 0.0f;
  arrives = r.transmits ? 1.0f : (below ? -1.0f : arrives);

  float cos_e = clamp(-dot(octahedral_unpack(n.axis), wi), -1.0f, 1.0f);
  cos_e = (n.cone & HW_LIGHT_TREE_TWO_SIDED) != 0u ? abs(cos_e) : cos_e;
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
  float value = n.power * max(arrives, HW_LIGHT_TREE_SLACK) * max(leaves, HW_LIGHT_TREE_SLACK) * falloff;
  return clamp(value, 1e-30f, 1e30f);
}

// The chance of going to the first of two siblings; below 0 where neither can contribute.
HW_FN float light_tree_first_chance(HW_IN(LightTreeNode) a, HW_IN(LightTreeNode) b, HW_IN(LightTreeReceiver) r) {
  float first = light_tree_importance(a, r);
  float second = light_tree_importance(b, r);
  float sum = first + second;
  if (!(sum > 0.0f)) {
    return -1.0f;
  }
  // Neither is left without any chance that a random number could give it.
  float chance = clamp(first / sum, 1e-6f, 1.0f - 1e-6f);
  return first > 0.0f ? (second > 0.0f ? chance : 1.0f) : 0.0f;
}

// Draws a light below `node` with u in [0, 1): its index, and the chance of it, given the node. HW_NONE with pdf 0: no
// light below can contribute. u is left uniform, to be used again. Each step down stretches u; where its 24 bits run
// out, hashed ones come behind them.
HW_FN uint light_tree_draw(HW_IN(LightTreeTables) tree, uint node, HW_IN(LightTreeReceiver) r, HW_INOUT(float) u,
                           HW_OUT(float) pdf) {
  LightTreeNode n = light_tree_load(tree.nodes, node);
  uint child = n.child;
  uint first = n.first;
  pdf = 1.0f;
  float grain = 5.9604644775390625e-8f;  // step of the values that u can have
  uint hash = floatBitsToUint(u) ^
              sampler_hash(floatBitsToUint(r.position.x) ^
                           sampler_hash(floatBitsToUint(r.position.y) ^ sampler_hash(floatBitsToUint(r.position.z))));
  while (child != HW_NONE) {
    LightTreeNode a = light_tree_load(tree.nodes, child);
    LightTreeNode b = light_tree_load(tree.nodes, child + 1u);
    float chance = light_tree_first_chance(a, b, r);
    if (chance < 0.0f) {
      pdf = 0.0f;
      return HW_NONE;
    }
    bool left = u < chance;
    float taken = left ? chance : 1.0f - chance;
    u = (left ? u : u - chance) / taken;
    pdf *= taken;
    grain /= taken;
    if (grain > 2.44140625e-4f) {
      hash = sampler_hash(hash);
      u += grain * sampler_to_float(hash);
      grain = 5.9604644775390625e-8f;
    }
    u = clamp(u, 0.0f, 0.99999994f);
    child = left ? a.child : b.child;
    first = left ? a.first : b.first;
  }
  return HW_LIGHT_TREE_UINT(tree.order, first);
}

// The chance with which light_tree_draw gives `light` below `node`: the same numbers in the same order. 0 for a light
// that is not below it.
HW_FN float light_tree_chance(HW_IN(LightTreeTables) tree, uint node, uint light, HW_IN(LightTreeReceiver) r) {
  uint position = HW_LIGHT_TREE_UINT(tree.position, light);
  LightTreeNode n = light_tree_load(tree.nodes, node);
  if (position == HW_NONE || position < n.first || position - n.first >= n.count) {
    return 0.0f;
  }
  uint child = n.child;
  float pdf = 1.0f;
  while (child != HW_NONE && pdf > 0.0f) {
    LightTreeNode a = light_tree_load(tree.nodes, child);
    LightTreeNode b = light_tree_load(tree.nodes, child + 1u);
    float chance = light_tree_first_chance(a, b, r);
    bool left = position < b.first;
    float taken = left ? chance : 1.0f - chance;
    pdf *= chance < 0.0f ? 0.0f : taken;
    child = left ? a.child : b.child;
  }
  return pdf;
}

HW_NAMESPACE_END
#endif
