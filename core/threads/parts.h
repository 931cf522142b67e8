// SPDX-License-Identifier: Apache-2.0
// Loops on several threads: over a range in parts, or over tasks of unequal size by turns. What comes of them must not
// depend on which thread did what.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>

#include "threads/both.h"

namespace hw {

// How many threads `wanted` stands for: 0 is one for each of the machine's.
inline int thread_count(int wanted) {
  return wanted > 0 ? wanted : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Calls body(begin, end) for parts of [begin, end), none of which is cut below `grain`. body may not throw.
template <class Body>
void in_parts(int threads, std::size_t grain, std::size_t begin, std::size_t end, const Body& body) {
  if (threads < 2 || end - begin < grain) return body(begin, end);
  const std::size_t middle = begin + (end - begin) / 2;
  both(
      threads, [&](int n) { in_parts(n, grain, begin, middle, body); },
      [&](int n) { in_parts(n, grain, middle, end, body); });
}

// Calls work(i) once for each i below count, whichever thread is free. Returns when all threads are done; the first
// exception then goes on, and what had not begun when it came is left out.
template <class Work>
void in_turns(int threads, std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr error;
  std::mutex mutex;
  const auto run = [&](std::size_t, std::size_t) {
    for (std::size_t i; (i = next.fetch_add(1)) < count;) try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!error) error = std::current_exception();
        next = count;
      }
  };
  const std::size_t runs = std::min(count, static_cast<std::size_t>(std::max(1, threads)));
  in_parts(static_cast<int>(runs), 2, 0, runs, run);
  if (error) std::rethrow_exception(error);
}

}  // namespace hw
