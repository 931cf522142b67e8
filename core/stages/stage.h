// SPDX-License-Identifier: Apache-2.0
// How the host runs a stage: kernels specialised for a scene, the push constant they share, and the queues between
// them.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
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

// Thrown where a render was cancelled before it had a picture to keep. No error: the render loop ends by it.
struct RenderCancelled {};

// Keeps every kernel that was asked for: a kernel costs a compilation on the driver's side, which can take seconds and
// can't be stopped. It runs on a thread of its own, so that a render that is cancelled need not wait for it; the kernel
// is there for the next one then. Safe to call from any thread.
class KernelCache {
 public:
  explicit KernelCache(Device& device) : device_(device) {}
  ~KernelCache();  // waits for a compilation that goes on
  KernelCache(const KernelCache&) = delete;
  KernelCache& operator=(const KernelCache&) = delete;
  // Constants that the kernel does not read make no other kernel (gpu/read_constants.h).
  // Throws RenderCancelled once the flag of the Interruptible that is alive is set and the kernel is not there yet.
  const Kernel& get(std::string_view name, const SpecConstants& constants = {});
  void wait();  // until nothing compiles

  // While it lives, get() stops waiting when `cancelled` is set.
  class Interruptible {
   public:
    Interruptible(KernelCache& cache, const std::atomic<bool>& cancelled) : cache_(cache) {
      cache_.cancelled_ = &cancelled;
    }
    ~Interruptible() { cache_.cancelled_ = nullptr; }
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;

   private:
    KernelCache& cache_;
  };

 private:
  using Key = std::pair<std::string, SpecConstants>;
  void compile(const Key& key);
  void run_nothing(const Kernel& kernel);

  Device& device_;
  std::atomic<const std::atomic<bool>*> cancelled_{nullptr};
  std::unique_ptr<Buffer> zeros_;  // the compiler's: no groups, and uniforms for them
  std::mutex mutex_;               // guards what follows
  std::condition_variable compiled_;
  std::map<Key, std::unique_ptr<Kernel>> kernels_;
  std::map<std::string, std::map<std::uint32_t, std::uint32_t>, std::less<>> bits_read_;  // by kernel
  std::thread compiler_;
  bool compiling_ = false;
  Key failed_;
  std::exception_ptr failure_;  // of `failed_`
};

// A queue of path ids with room for `capacity`.
struct Queue {
  Queue(Device& device, std::uint32_t capacity, std::string_view label)
      : buffer(device, sizeof(QueueHeader) + std::size_t(capacity) * 4, BufferUse::device, label) {}
  Buffer buffer;
  std::uint64_t address() const { return buffer.address(); }
};

}  // namespace hw
