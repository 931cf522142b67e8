// SPDX-License-Identifier: Apache-2.0
// Buffers of the hash table.
#include "reservoirs/light_cells.h"

#include <algorithm>
#include <span>
#include <vector>

namespace hw {

namespace {

constexpr std::uint64_t kBucketBytes = HW_LIGHT_CELL_WAYS * (sizeof(LightCell) + 4) + sizeof(LightCellRequest);

std::uint32_t buckets_in(std::uint64_t bytes) {
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(bytes / kBucketBytes, 1, 1u << 28));
}

}  // namespace

std::uint64_t LightCells::bytes_used(std::uint64_t bytes) { return buckets_in(bytes) * kBucketBytes; }

LightCells::LightCells(Device& device, std::uint64_t bytes) : buckets_(buckets_in(bytes)) {
  cells_ =
      std::make_unique<Buffer>(device, std::uint64_t(count()) * sizeof(LightCell), BufferUse::device, "light cells");
  tags_ = std::make_unique<Buffer>(device, std::uint64_t(count()) * 4, BufferUse::device, "light cell tags");
  requests_ = std::make_unique<Buffer>(device, std::uint64_t(buckets_) * sizeof(LightCellRequest), BufferUse::device,
                                       "light cell requests");
}

std::uint64_t LightCells::bytes() const { return cells_->bytes() + tags_->bytes() + requests_->bytes(); }

std::uint32_t LightCells::used(Device& device) const {
  std::vector<std::uint32_t> tags(count());
  device.read(*tags_, 0, std::as_writable_bytes(std::span(tags)));
  return static_cast<std::uint32_t>(tags.size() - std::count(tags.begin(), tags.end(), 0u));
}

void LightCells::fill(LightCellFrame& frame) const {
  frame.cells = cells_->address();
  frame.tags = tags_->address();
  frame.requests = requests_->address();
  frame.buckets = buckets_;
}

}  // namespace hw
