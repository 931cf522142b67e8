// SPDX-License-Identifier: Apache-2.0
// A k-d tree over points of the scene, one reservoir (or a few) a leaf. Built by core/reservoirs/kd_tree.cpp, read by
// lib/kd_tree.h.
//
// The tree is perfect: every leaf is `depth` levels below the root. So nodes need no links: they lie as a heap,
// children of i at 2 i + 1 (below the split) and 2 i + 2, leaves are numbered from left to right, and the leaves of a
// subtree are consecutive. A node is 4 bytes: the bits of the split coordinate with the axis (0, 1, 2) in the two
// lowest, which are taken as zero in the coordinate.
#ifndef HW_KD_TREE_SHARED_H
#define HW_KD_TREE_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_KD_MAX_DEPTH = 24u;

struct KdTree {
  uint64_t nodes;   // uint[leaf_count - 1]; not read where depth is 0
  uint depth;       // levels of nodes, at most HW_KD_MAX_DEPTH; 0: one leaf
  uint leaf_count;  // 2^depth
};
HW_CHECK_SIZE(KdTree, 16)

HW_NAMESPACE_END
#endif
