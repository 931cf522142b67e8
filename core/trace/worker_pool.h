// SPDX-License-Identifier: Apache-2.0
// Persistent worker threads for tracing on the host: chunks of an index range handed out by an atomic counter.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace hw {

// Denormals are flushed (FTZ, DAZ) while it lives: Embree's traversal slows down several times on them.
class FlushDenormals {
 public:
  FlushDenormals();
  ~FlushDenormals();

 private:
  unsigned before_;
};

class WorkerPool {
 public:
  explicit WorkerPool(int threads);  // the calling thread is one of them; 0: one a hardware thread
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls work(begin, end) over [0, count) in chunks, on all threads, with denormals flushed; returns when all are
  // done. `work` must not throw. One run at a time.
  template <class Work>
  void run(std::uint32_t count, std::uint32_t chunk, const Work& work) {
    run_erased(count, chunk, &work, [](const void* context, std::uint32_t begin, std::uint32_t end) {
      (*static_cast<const Work*>(context))(begin, end);
    });
  }

 private:
  using Call = void (*)(const void*, std::uint32_t, std::uint32_t);
  void run_erased(std::uint32_t count, std::uint32_t chunk, const void* context, Call call);
  void work_loop();
  void drain();

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::uint64_t round_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  std::atomic<std::uint64_t> next_{0};
  std::uint32_t count_ = 0, chunk_ = 1;
  const void* context_ = nullptr;
  Call call_ = nullptr;
};

}  // namespace hw
