// SPDX-License-Identifier: Apache-2.0
// Buffers of cells and of the tree's nodes.
#include "reservoirs/cell_reservoirs.h"

#include <algorithm>

#include "reservoirs/kd_tree.h"

namespace hw {

CellReservoirs::CellReservoirs(Device& device, std::uint64_t count) : count_(std::uint32_t(count)) {
  if (count > 0xFFFFFFFEu / 2)
    throw OutOfMemory("the reservoirs of " + std::to_string(count) +
                      " cells are more than can be addressed: lower the resolution or the reservoirs a cell");
  cells_ = std::make_unique<Buffer>(device, count * sizeof(ReuseCell), BufferUse::device, "reservoir cells");
  touched_ = std::make_unique<Queue>(device, count_, "touched cells");
}

std::unique_ptr<CellReservoirs> CellReservoirs::of_grid(Device& device, std::uint32_t resolution, std::uint32_t slots) {
  const std::uint64_t n = resolution;
  return std::unique_ptr<CellReservoirs>(new CellReservoirs(device, n * n * n * slots));
}

std::unique_ptr<CellReservoirs> CellReservoirs::of_tree(Device& device, std::span<const vec3> points,
                                                        std::uint32_t points_per_leaf, std::uint32_t slots,
                                                        int threads) {
  const KdTreeNodes built = build_kd_tree(points, points_per_leaf, threads);
  std::unique_ptr<CellReservoirs> cells(new CellReservoirs(device, std::uint64_t(built.leaf_count) * slots));
  if (!built.words.empty()) cells->nodes_ = device.upload(std::as_bytes(std::span(built.words)), "k-d tree nodes");
  cells->tree_ = {cells->nodes_ ? cells->nodes_->address() : 0, built.depth, built.leaf_count};
  return cells;
}

std::uint64_t CellReservoirs::bytes() const {
  return cells_->bytes() + touched_->buffer.bytes() + (nodes_ ? nodes_->bytes() : 0);
}

void CellReservoirs::fill(ReuseFrame& frame) const {
  frame.cells = cells_->address();
  frame.touched = touched_->address();
  frame.cell_count = count_;
  frame.tree = tree_;
}

}  // namespace hw
