// SPDX-License-Identifier: Apache-2.0
// Builds the k-d tree of shared/kd_tree.h over points on the host, once (SivaramWSSR, section 4.1: static, from the
// surfaces of the first picture).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shared/kd_tree.h"

namespace hw {

struct KdTreeNodes {
  std::vector<std::uint32_t> words;  // leaf_count - 1 nodes, as a heap
  std::uint32_t depth = 0;
  std::uint32_t leaf_count = 1;
  std::size_t points = 0;   // that it was built over
  std::size_t dropped = 0;  // that were NaN or infinite

  // For use on the host; valid as long as this object is. The device's has another address.
  KdTree header() const { return {reinterpret_cast<std::uint64_t>(words.data()), depth, leaf_count}; }
};

// ceil(log2(points / points_per_leaf)), in [0, HW_KD_MAX_DEPTH]. points_per_leaf of 0 counts as 1.
std::uint32_t kd_tree_depth(std::size_t points, std::uint32_t points_per_leaf);

// Nodes are split at the median along the axis in which their points extend furthest. A leaf holds at most
// points_per_leaf points, unless the depth is capped or points coincide along the axis to within four units in the last
// place; then the leaf that gets them has more and another fewer. The tree depends on the set of points alone, not on
// their order nor on `threads` (0: as many as the machine has). O(n log n) time; 12 bytes a point of scratch.
KdTreeNodes build_kd_tree(std::span<const vec3> points, std::uint32_t points_per_leaf, int threads = 0);

}  // namespace hw
