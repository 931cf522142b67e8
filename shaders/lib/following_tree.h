// SPDX-License-Identifier: Apache-2.0
// Leaves of a k-d tree that follows its scene (shared/following_tree.h): the one a point lies in, and neighbours of it.
// Each node knows its range of leaves, so that one is drawn uniformly at once, whatever the tree's shape; see
// lib/kd_tree.h for what SivaramWSSR, Algorithm 4, does instead.
#ifndef HW_FOLLOWING_TREE_H
#define HW_FOLLOWING_TREE_H
#include "../shared/following_tree.h"
#include "kd_tree.h"
#ifdef __cplusplus
#define HW_FOLLOWING_NODE(ADDRESS, INDEX) (reinterpret_cast<const FollowingNode*>(ADDRESS)[INDEX])
#define HW_FOLLOWING_SLOT(ADDRESS, RANK) (reinterpret_cast<const uint*>(ADDRESS)[RANK])
#else
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer FollowingNodes { FollowingNode at[]; };
#define HW_FOLLOWING_NODE(ADDRESS, INDEX) (FollowingNodes(ADDRESS).at[INDEX])
#define HW_FOLLOWING_SLOT(ADDRESS, RANK) (KdNodes(ADDRESS).at[RANK])
#endif
HW_NAMESPACE_BEGIN

// No path to a leaf is longer: core/reservoirs/following_tree.cpp sees to it.
HW_CONST uint HW_FOLLOWING_MAX_DEPTH = 64u;

HW_FN bool following_is_leaf(FollowingNode n) { return (n.size & 3u) == HW_FOLLOWING_LEAF; }
HW_FN uint following_leaves(FollowingNode n) { return n.size >> 2u; }
HW_FN float following_coordinate(FollowingNode n, vec3 P) {
  uint axis = n.size & 3u;
  return axis == 0u ? P.x : axis == 1u ? P.y : P.z;
}

// The node at most `levels` below the root on the way to P (world space), and how far below the root that is. Every
// point has a way, NaN too.
HW_FN FollowingNode following_descend(FollowingTree t, vec3 P, uint levels, HW_OUT(uint) depth) {
  FollowingNode n = HW_FOLLOWING_NODE(t.nodes, 0u);
  depth = 0u;
  while (depth < levels && !following_is_leaf(n)) {
    n = HW_FOLLOWING_NODE(t.nodes, n.link + (following_coordinate(n, P) >= n.split ? 1u : 0u));
    ++depth;
  }
  return n;
}

// The leaf P lies in.
HW_FN FollowingNode following_leaf(FollowingTree t, vec3 P) {
  uint depth;
  return following_descend(t, P, HW_FOLLOWING_MAX_DEPTH, depth);
}

// The subtree that neighbours of a leaf are drawn from: `ascension` levels above it.
HW_FN FollowingNode following_above(FollowingTree t, vec3 P, uint ascension) {
  uint depth;
  following_descend(t, P, HW_FOLLOWING_MAX_DEPTH, depth);
  return following_descend(t, P, depth - min(ascension, depth), depth);
}

// Slot of draw i of k among the subtree's leaves but the one ranked `own`; HW_NONE: there is no other. As
// kd_draw_other.
HW_FN uint following_neighbour_of(FollowingTree t, FollowingNode subtree, uint own, uint i, uint k, float u) {
  uint chosen = kd_draw_other(own - subtree.first, following_leaves(subtree), i, k, u);
  return chosen == HW_NONE ? HW_NONE : HW_FOLLOWING_SLOT(t.order, subtree.first + chosen);
}

HW_NAMESPACE_END
#endif
