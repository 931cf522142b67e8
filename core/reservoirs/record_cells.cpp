// SPDX-License-Identifier: Apache-2.0
// Buffers of records and of the tree that follows.
#include "reservoirs/record_cells.h"

#include <utility>

#include "reservoirs/kd_tree.h"

namespace hw {

RecordCells::RecordCells(Device& device, std::uint64_t count, std::unique_ptr<FollowingTreeHost> tree)
    : count_(std::uint32_t(count)), tree_(std::move(tree)) {
  if (count > 0xFFFFFFFEu / 2)
    throw OutOfMemory("the reservoirs of " + std::to_string(count) +
                      " cells are more than can be addressed: lower the resolution or the reservoirs a cell");
  const auto make = [&](std::size_t bytes, const char* label) {
    return std::make_unique<Buffer>(device, bytes, BufferUse::device, label);
  };
  records_ = make(count * sizeof(ReuseRecord), "reservoir records");
  next_ = make(count * sizeof(ReuseRecord), "reservoir records of the pass");
  cells_ = make(count * sizeof(RecordCell), "reservoir cells");
  touched_ = std::make_unique<Queue>(device, count_, "touched cells");
  if (!tree_) return;
  witnesses_ = make(count * sizeof(vec3), "leaf witnesses");
  nodes_ = make(2 * std::size_t(tree_->capacity()) * sizeof(FollowingNode), "following tree nodes");
  order_ = make(tree_->capacity() * sizeof(std::uint32_t), "following tree leaves");
  write_tree(device);
}

std::unique_ptr<RecordCells> RecordCells::of_grid(Device& device, std::uint32_t resolution, std::uint32_t slots) {
  const std::uint64_t n = resolution;
  return std::unique_ptr<RecordCells>(new RecordCells(device, n * n * n * slots, nullptr));
}

std::unique_ptr<RecordCells> RecordCells::of_tree(Device& device, std::span<const vec3> points,
                                                  std::uint32_t points_per_leaf, std::uint32_t slots, int threads) {
  const KdTreeNodes built = build_kd_tree(points, points_per_leaf, threads);
  auto tree = std::make_unique<FollowingTreeHost>(built, std::uint32_t(following_tree_capacity(built.leaf_count)));
  const std::uint64_t count = std::uint64_t(tree->capacity()) * slots;
  return std::unique_ptr<RecordCells>(new RecordCells(device, count, std::move(tree)));
}

std::uint64_t RecordCells::bytes() const {
  std::uint64_t sum = touched_->buffer.bytes();
  for (const auto* buffer : {&records_, &next_, &cells_, &witnesses_, &nodes_, &order_})
    if (*buffer) sum += (*buffer)->bytes();
  return sum;
}

void RecordCells::fill(ReuseFrame& frame) const {
  frame.records = records_->address();
  frame.next_records = next_->address();
  frame.record_cells = cells_->address();
  frame.witnesses = witnesses_ ? witnesses_->address() : 0;
  frame.leaves = {nodes_ ? nodes_->address() : 0, order_ ? order_->address() : 0};
  frame.touched = touched_->address();
  frame.cell_count = count_;
}

void RecordCells::follow(Device& device, std::span<const LeafSurvey> seen, const FollowingTreeHost::Rules& rules) {
  if (tree_ && tree_->follow(seen, rules)) write_tree(device);
}

void RecordCells::write_tree(Device& device) {
  device.write(*nodes_, 0, std::as_bytes(std::span(tree_->nodes())));
  device.write(*order_, 0, std::as_bytes(std::span(tree_->order())));
}

}  // namespace hw
