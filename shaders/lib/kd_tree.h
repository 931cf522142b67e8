// SPDX-License-Identifier: Apache-2.0
// Leaves of a k-d tree (shared/kd_tree.h): the one a point lies in, and neighbours of one.
//
// Neighbours follow SivaramWSSR, Algorithm 4, with these departures:
//  - as printed, it never increments its level counter and so climbs to the root; here it climbs `ascension` levels;
//  - it descends by random branches, which is uniform over leaves only in a balanced tree; here leaves of a subtree are
//    consecutive, so that one is drawn uniformly at once;
//  - it may come back to the leaf it started from, whose reservoir section 4.1.1 wants left out; here it cannot;
//  - its draws may repeat; kd_neighbour_of gives several that differ.
#ifndef HW_KD_TREE_H
#define HW_KD_TREE_H
#include "../shared/kd_tree.h"
#ifdef __cplusplus
#define HW_KD_NODE(ADDRESS, INDEX) (reinterpret_cast<const uint*>(ADDRESS)[INDEX])
#else
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer KdNodes { uint at[]; };
#define HW_KD_NODE(ADDRESS, INDEX) (KdNodes(ADDRESS).at[INDEX])
#endif
HW_NAMESPACE_BEGIN

HW_FN uint kd_node(float split, uint axis) { return (floatBitsToUint(split) & 0xFFFFFFFCu) | axis; }
HW_FN float kd_split(uint node) { return uintBitsToFloat(node & 0xFFFFFFFCu); }
HW_FN uint kd_axis(uint node) { return node & 3u; }

// Whether P lies above a node's split: a point on the split does.
HW_FN bool kd_above(uint node, vec3 P) {
  uint axis = kd_axis(node);
  return (axis == 0u ? P.x : axis == 1u ? P.y : P.z) >= kd_split(node);
}

// The leaf P (world space) lies in, below leaf_count. Every point lies in one; for a NaN it is any.
HW_FN uint kd_leaf(KdTree t, vec3 P) {
  uint i = 0u;
  for (uint level = 0u; level < t.depth; ++level) {
    i = 2u * i + (kd_above(HW_KD_NODE(t.nodes, i), P) ? 2u : 1u);
  }
  return i - (t.leaf_count - 1u);
}

// Draw i of k (i < k < 256) of the numbers below `count` but `own`. The draws of one u in [0, 1) differ as long as
// there are k others, lie spread over them, and each is among them with the same probability. HW_NONE: there is no
// other.
HW_FN uint kd_draw_other(uint own, uint count, uint i, uint k, float u) {
  if (count < 2u) {
    return HW_NONE;
  }
  // floor((i + u) others / k), in integers: floats would round two draws to one leaf.
  uint fraction = uint(clamp(u, 0.0f, 0.99999994f) * 16777216.0f);
  uint64_t place = (uint64_t(i) << 24u) | uint64_t(fraction);
  uint chosen = uint((place * uint64_t(count - 1u)) >> 24u) / k;
  return chosen < own ? chosen : chosen + 1u;
}

// Such a draw among the other leaves of the subtree that lies min(ascension, depth) levels above `leaf`.
HW_FN uint kd_neighbour_of(KdTree t, uint leaf, uint ascension, uint i, uint k, float u) {
  uint count = 1u << min(ascension, t.depth);
  uint first = leaf - leaf % count;
  uint chosen = kd_draw_other(leaf - first, count, i, k, u);
  return chosen == HW_NONE ? HW_NONE : first + chosen;
}

// One of them, uniformly.
HW_FN uint kd_neighbour(KdTree t, uint leaf, uint ascension, float u) {
  return kd_neighbour_of(t, leaf, ascension, 0u, 1u, u);
}

HW_NAMESPACE_END
#endif
