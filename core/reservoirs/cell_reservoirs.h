// SPDX-License-Identifier: Apache-2.0
// World-space reservoirs: the cells (shared/reuse.h) of a k-d tree or a grid, and the structure that finds them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "gpu/device.h"
#include "shared/reuse.h"
#include "stages/stage.h"

namespace hw {

class CellReservoirs {
 public:
  // The cells of a grid: resolution^3 times `slots` reservoirs. Throws OutOfMemory.
  static std::unique_ptr<CellReservoirs> of_grid(Device& device, std::uint32_t resolution, std::uint32_t slots);
  // The leaves of a tree over `points` (world space), times `slots` reservoirs. Throws OutOfMemory.
  static std::unique_ptr<CellReservoirs> of_tree(Device& device, std::span<const vec3> points,
                                                 std::uint32_t points_per_leaf, std::uint32_t slots, int threads);

  std::uint32_t count() const { return count_; }
  std::uint64_t bytes() const;
  // Points a frame's parameters at cells and tree; the grid's window is set by the caller, who knows the camera.
  void fill(ReuseFrame& frame) const;

  Queue& touched() { return *touched_; }  // cells that were offered samples in this pass

  bool has_history = false;  // a pass has been merged into the cells

 private:
  CellReservoirs(Device& device, std::uint64_t count);
  std::uint32_t count_;
  std::unique_ptr<Buffer> cells_, nodes_;
  std::unique_ptr<Queue> touched_;
  KdTree tree_{0, 0, 1};
};

}  // namespace hw
