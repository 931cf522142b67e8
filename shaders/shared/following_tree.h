// SPDX-License-Identifier: Apache-2.0
// A k-d tree whose leaves come and go (core/reservoirs/following_tree.h), read by lib/following_tree.h. Unlike the
// perfect tree of shared/kd_tree.h its nodes have links, and each knows the range of leaves below it.
#ifndef HW_FOLLOWING_TREE_SHARED_H
#define HW_FOLLOWING_TREE_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

struct FollowingNode {
  float split;  // world space [m]: points on it lie above
  uint link;    // node: the child below the split, the one above follows it; leaf: its slot
  uint first;   // rank of the first leaf below this node: leaves are ranked from left to right
  uint size;    // two lowest bits: axis of the split (0, 1, 2), 3: a leaf; the others: how many leaves lie below
};
HW_CHECK_SIZE(FollowingNode, 16)
HW_CONST uint HW_FOLLOWING_LEAF = 3u;

struct FollowingTree {
  uint64_t nodes;  // FollowingNode[], the root first
  uint64_t order;  // uint[leaves]: the slot of the leaf of each rank
};
HW_CHECK_SIZE(FollowingTree, 16)

HW_NAMESPACE_END
#endif
