// SPDX-License-Identifier: Apache-2.0
// Batches of copies through one staging buffer, for devices with memory of their own.
#include "scene/upload.h"

namespace hw {
namespace {

constexpr std::size_t kStagingBytes = std::size_t{32} << 20;

}  // namespace

void Uploader::write(Buffer& to, std::size_t offset, std::span<const std::byte> data) {
  if (data.empty()) return;
  bytes_ += data.size();
  if (to.mapped()) {
    std::memcpy(to.as<std::byte>() + offset, data.data(), data.size());
    return;
  }
  if (!staging_) staging_ = std::make_unique<Buffer>(device_, kStagingBytes, BufferUse::upload, "table staging");
  while (!data.empty()) {
    if (used_ == staging_->bytes()) submit();
    const std::size_t bytes = std::min(data.size(), staging_->bytes() - used_);
    std::memcpy(staging_->as<std::byte>() + used_, data.data(), bytes);
    pieces_.push_back({&to, offset, used_, bytes});
    used_ = std::min((used_ + bytes + 15) / 16 * 16, staging_->bytes());
    offset += bytes;
    data = data.subspan(bytes);
  }
}

void Uploader::submit() {
  if (pieces_.empty()) return;
  Commands commands(device_);
  for (const Piece& piece : pieces_)
    commands.copy(*staging_, piece.from_offset, *piece.to, piece.to_offset, piece.bytes);
  commands.flush();
  pieces_.clear();
  used_ = 0;
}

void Uploader::flush() {
  submit();
  staging_.reset();
}

}  // namespace hw
