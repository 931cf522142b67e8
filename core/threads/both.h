// SPDX-License-Identifier: Apache-2.0
// Forks for builds that divide and conquer: two halves, the first on a thread of its own where there are threads for
// it.
#pragma once

#include <system_error>
#include <thread>

namespace hw {

// Calls first(n) and second(n), n being the threads each may use, and returns when both have. With one thread, or where
// none is to be had, one after the other. first may not throw.
template <class First, class Second>
void both(int threads, const First& first, const Second& second) {
  if (threads < 2) {
    first(1);
    second(1);
    return;
  }
  std::jthread other;
  try {
    other = std::jthread(first, threads / 2);
  } catch (const std::system_error&) {  // no thread to be had
    first(1);
  }
  second(threads - threads / 2);
}

}  // namespace hw
