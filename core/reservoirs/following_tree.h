// SPDX-License-Identifier: Apache-2.0
// A k-d tree over surface points that follows a changing scene: crowded leaves are divided, leaves that no path comes
// by any more are taken back. SivaramWSSR, section 4.1, has a static tree and leaves insertion and removal open.
//
// Leaves are slots, of which there is a fixed number: a slot keeps its memory on the device whatever becomes of the
// tree around it. After each change the leaves are ranked from left to right again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reservoirs/kd_tree.h"
#include "shared/following_tree.h"
#include "shared/reuse.h"

namespace hw {

class FollowingTreeHost {
 public:
  // As the perfect tree, its leaves in slots of their number. `capacity`: slots there are, at least its leaves.
  FollowingTreeHost(const KdTreeNodes& built, std::uint32_t capacity);

  struct Rules {
    std::uint32_t crowded;       // a leaf that more surfaces fell in is divided
    std::uint32_t pass;          // that is over
    std::uint32_t stale_passes;  // a leaf that none fell in for as many passes may go; of a leaf never seen,
                                 // LeafSurvey::pass is when it came to be
    std::uint32_t budget;        // most leaves that come, and most that go, in one call
  };
  // Takes back leaves that are stale, two that share a parent at once, then divides the most crowded leaves of the last
  // passes between the two surfaces known of each. seen: of each slot. True: something changed. The tree depends on
  // `seen` alone. O(leaves) time.
  bool follow(std::span<const LeafSurvey> seen, const Rules& rules);

  // Whether most surfaces of the last pass fell in leaves so crowded that the tree would take many calls to catch up,
  // as after a cut to another place: it should be built anew.
  static bool outgrown(std::span<const LeafSurvey> seen, const Rules& rules);

  const std::vector<FollowingNode>& nodes() const { return nodes_; }
  const std::vector<std::uint32_t>& order() const { return order_; }  // slots by rank
  std::uint32_t capacity() const { return capacity_; }
  std::uint32_t leaves() const { return std::uint32_t(order_.size()); }
  // For use on the host; valid until the tree changes.
  FollowingTree header() const;

 private:
  bool prune(std::span<const LeafSurvey> seen, const Rules& rules);
  bool divide(std::span<const LeafSurvey> seen, const Rules& rules);
  void rank();

  std::uint32_t capacity_;
  std::vector<FollowingNode> nodes_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> free_slots_, free_pairs_;  // taken from the end
  std::vector<std::uint32_t> leaf_of_, depth_of_;       // of each slot: its node, HW_NONE if free; its depth
};

}  // namespace hw
