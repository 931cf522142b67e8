// SPDX-License-Identifier: Apache-2.0
// The hash table of `wssr-hash` (shared/light_cells.h) within a given amount of memory.
#pragma once

#include <cstdint>
#include <memory>

#include "gpu/device.h"
#include "shared/light_cells.h"
#include "stages/stage.h"

namespace hw {

class LightCells {
 public:
  // As many cells as fit in `bytes`, at least one bucket. Throws OutOfMemory.
  LightCells(Device& device, std::uint64_t bytes);

  // What a table in `bytes` takes of them.
  static std::uint64_t bytes_used(std::uint64_t bytes);
  std::uint32_t buckets() const { return buckets_; }
  std::uint32_t count() const { return buckets_ * HW_LIGHT_CELL_WAYS; }
  std::uint64_t bytes() const;
  // How many hold something. Reads the tags back: the device must be the caller's.
  std::uint32_t used(Device& device) const;
  // Points a frame's parameters at the table.
  void fill(LightCellFrame& frame) const;

  std::uint64_t tree = 0;            // the light tree that cells' cuts are made of (Tables::light_tree_revision)
  std::uint64_t fit = 0;             // the tree's bounds that slots were made of (Tables::light_tree_fit)
  float unit = 1;                    // of importance in what cells know (Tables::light_tree_unit)
  std::uint32_t passes = 0;          // that cells have been updated by
  std::uint32_t frames = 0;          // that went on with what cells knew
  bool by_tree = false;              // lights had best be drawn by the tree, and cells left alone
  bool one_light_sample = false;     // then: one does of what the camera sees first, where nobody asks for a number
  bool path_reuse = false;           // pixels had best share what their paths find (integrators/path_reuse.h)
  std::uint32_t bounce_samples = 1;  // paths that had best go on from a surface (integrators/path_splitting.h)

 private:
  std::uint32_t buckets_;
  std::unique_ptr<Buffer> cells_, tags_, requests_;
};

}  // namespace hw
