// SPDX-License-Identifier: Apache-2.0
// Persistent worker threads for tracing on the host.

#include "trace/worker_pool.h"

#include <algorithm>
#include <system_error>

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>
#endif

namespace hw {

FlushDenormals::FlushDenormals() {
#if defined(__x86_64__) || defined(_M_X64)
  before_ = _mm_getcsr();
  _mm_setcsr(before_ | 0x8040);  // FTZ (bit 15) and DAZ (bit 6)
#else
  before_ = 0;
#endif
}

FlushDenormals::~FlushDenormals() {
#if defined(__x86_64__) || defined(_M_X64)
  _mm_setcsr(before_);
#endif
}

WorkerPool::WorkerPool(int threads) {
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  workers_.reserve(static_cast<std::size_t>(threads));
  try {
    for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { work_loop(); });
  } catch (const std::system_error&) {  // no more threads to be had: those there are do it
  }
}

WorkerPool::~WorkerPool() {
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::run_erased(std::uint32_t count, std::uint32_t chunk, const void* context, Call call) {
  if (count == 0) return;
  const FlushDenormals flush;
  if (workers_.empty() || count <= chunk) {
    for (std::uint64_t begin = 0; begin < count; begin += chunk)
      call(context, static_cast<std::uint32_t>(begin),
           static_cast<std::uint32_t>(std::min<std::uint64_t>(begin + chunk, count)));
    return;
  }
  {
    std::lock_guard lock(mutex_);
    count_ = count;
    chunk_ = chunk;
    context_ = context;
    call_ = call;
    next_ = 0;
    busy_ = static_cast<int>(workers_.size());
    ++round_;
  }
  wake_.notify_all();
  drain();
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

void WorkerPool::work_loop() {
  const FlushDenormals flush;
  std::uint64_t seen = 0;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return stop_ || round_ != seen; });
    if (stop_) return;
    seen = round_;
    lock.unlock();
    drain();
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

void WorkerPool::drain() {
  for (;;) {
    const std::uint64_t begin = next_.fetch_add(chunk_, std::memory_order_relaxed);
    if (begin >= count_) return;
    call_(context_, static_cast<std::uint32_t>(begin),
          static_cast<std::uint32_t>(std::min<std::uint64_t>(begin + chunk_, count_)));
  }
}

}  // namespace hw
