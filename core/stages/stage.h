// SPDX-License-Identifier: Apache-2.0
// How the host runs a stage: kernels specialised for a scene, the push constant they share, and the queues between
// them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "gpu/device.h"
#include "shared/rays.h"

namespace hw {

// Same layout as lib/push.glsl.
struct Push {
  std::uint64_t queue = 0;
  std::uint64_t out_queue = 0;
  std::uint64_t out_queue2 = 0;
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(this, 1)); }
};

// Keeps every kernel that was asked for: a kernel costs a compilation on the driver's side. Safe to call from any
// thread.
class KernelCache {
 public:
  explicit KernelCache(Device& device) : device_(device) {}
  const Kernel& get(std::string_view name, const SpecConstants& constants = {});

 private:
  Device& device_;
  std::mutex mutex_;
  std::map<std::pair<std::string, SpecConstants>, std::unique_ptr<Kernel>> kernels_;
};

// A queue of path ids with room for `capacity`.
struct Queue {
  Queue(Device& device, std::uint32_t capacity, std::string_view label)
      : buffer(device, sizeof(QueueHeader) + std::size_t(capacity) * 4, BufferUse::device, label) {}
  Buffer buffer;
  std::uint64_t address() const { return buffer.address(); }
};

}  // namespace hw
