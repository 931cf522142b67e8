// SPDX-License-Identifier: Apache-2.0
// Getting table data to the device: a copy into mapped memory where the device shares it, else batches through staging.
#pragma once

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gpu/device.h"

namespace hw {

class Uploader {
 public:
  explicit Uploader(Device& device) : device_(device) {}
  // Copies now where `to` is mapped, else by the next flush() at the latest. `data` may go once write() returns.
  void write(Buffer& to, std::size_t offset, std::span<const std::byte> data);
  void flush();  // submits what is waiting; releases the staging buffer when it is large
  std::uint64_t bytes() const { return bytes_; }  // copied since construction

 private:
  struct Piece {
    Buffer* to;
    std::size_t to_offset, from_offset, bytes;
  };
  void submit();
  Device& device_;
  std::unique_ptr<Buffer> staging_;
  std::vector<Piece> pieces_;
  std::size_t used_ = 0;
  std::uint64_t bytes_ = 0;
};

// A growing device array of T that the host writes: into mapped memory itself, or into a copy of which flush() uploads
// the part that was touched. Growing doubles the room, so its address changes seldom; contents are kept.
template <class T>
class Table {
 public:
  Table(Device& device, std::string label) : device_(device), label_(std::move(label)) {}

  std::size_t size() const { return size_; }
  std::uint64_t address() const { return buffer_ ? buffer_->address() : 0; }
  const T* data() const { return data_; }
  const T& operator[](std::size_t i) const { return data_[i]; }

  void resize(std::size_t size) {
    const std::size_t room = buffer_ ? buffer_->bytes() / sizeof(T) : 0;
    if (size > room || !buffer_) {
      const std::size_t wanted = std::max({size, room == 0 ? size : 2 * room, std::size_t{1}});
      auto grown = std::make_unique<Buffer>(device_, wanted * sizeof(T), BufferUse::device, label_);
      if (grown->mapped()) {
        if (size_ > 0) std::memcpy(grown->mapped(), data_, size_ * sizeof(T));
        data_ = grown->template as<T>();
      } else {
        shadow_.resize(wanted);
        data_ = shadow_.data();
        touch(0, size_);
      }
      buffer_ = std::move(grown);
    }
    size_ = size;
    end_ = std::min(end_, size_);
    begin_ = std::min(begin_, end_);
  }

  // Entries [begin, begin + count), to be written by the caller.
  T* edit(std::size_t begin, std::size_t count) {
    touch(begin, begin + count);
    edited_ += count * sizeof(T);
    return data_ + begin;
  }
  void set(std::size_t at, const T& value) { *edit(at, 1) = value; }
  void assign(std::span<const T> values) {
    resize(values.size());
    if (!values.empty()) std::memcpy(static_cast<void*>(edit(0, values.size())), values.data(), values.size_bytes());
  }

  // Returns the bytes written since the last flush.
  std::uint64_t flush(Uploader& uploader) {
    if (buffer_ && !buffer_->mapped() && end_ > begin_)
      uploader.write(*buffer_, begin_ * sizeof(T), std::as_bytes(std::span<const T>(data_ + begin_, end_ - begin_)));
    begin_ = end_ = 0;
    const std::uint64_t bytes = edited_;
    edited_ = 0;
    return bytes;
  }

 private:
  void touch(std::size_t begin, std::size_t end) {
    if (begin >= end) return;
    begin_ = end_ > begin_ ? std::min(begin_, begin) : begin;
    end_ = std::max(end_, end);
  }

  Device& device_;
  std::string label_;
  std::unique_ptr<Buffer> buffer_;
  std::vector<T> shadow_;
  T* data_ = nullptr;
  std::size_t size_ = 0, begin_ = 0, end_ = 0;
  std::uint64_t edited_ = 0;
};

}  // namespace hw
