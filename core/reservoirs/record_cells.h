// SPDX-License-Identifier: Apache-2.0
// Cells of unbiased world-space estimators: a record each (shared/reuse.h), of a grid or of a k-d tree that follows the
// scene.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "gpu/device.h"
#include "reservoirs/following_tree.h"
#include "shared/reuse.h"
#include "stages/stage.h"

namespace hw {

// Slots for a tree of `leaves`: a quarter more, for places that are seen later.
inline std::uint64_t following_tree_capacity(std::uint64_t leaves) { return leaves + (leaves + 3) / 4; }

class RecordCells {
 public:
  // The cells of a grid: resolution^3 times `slots` records. Throws OutOfMemory.
  static std::unique_ptr<RecordCells> of_grid(Device& device, std::uint32_t resolution, std::uint32_t slots);
  // The leaves of a tree over `points` (world space), times `slots` records. Throws OutOfMemory.
  static std::unique_ptr<RecordCells> of_tree(Device& device, std::span<const vec3> points,
                                              std::uint32_t points_per_leaf, std::uint32_t slots, int threads);

  std::uint32_t count() const { return count_; }
  std::uint32_t leaf_slots() const { return tree_ ? tree_->capacity() : 0; }
  std::uint64_t bytes() const;
  // Points a frame's parameters at cells and tree; the grid's window is set by the caller, who knows the camera.
  void fill(ReuseFrame& frame) const;
  // Lets the tree follow what its leaves saw, and brings it to the device. Between passes only.
  void follow(Device& device, std::span<const LeafSurvey> seen, const FollowingTreeHost::Rules& rules);

  Queue& touched() { return *touched_; }  // cells that paths came by in this pass

  bool has_history = false;  // a pass has left records

 private:
  RecordCells(Device& device, std::uint64_t count, std::unique_ptr<FollowingTreeHost> tree);
  void write_tree(Device& device);

  std::uint32_t count_;
  std::unique_ptr<FollowingTreeHost> tree_;  // null: a grid
  std::unique_ptr<Buffer> records_, next_, cells_, witnesses_, nodes_, order_;
  std::unique_ptr<Queue> touched_;
};

}  // namespace hw
