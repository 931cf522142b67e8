// SPDX-License-Identifier: Apache-2.0
// Kernels by name: found again, refused, and not waited for once a render is cancelled.
#include <doctest/doctest.h>

#include "stages/stage.h"

using namespace hw;

TEST_CASE("a kernel cache gives the same kernel again and refuses unknown names each time") {
  Device device;
  KernelCache kernels(device);
  const Kernel& once = kernels.get("queue_prepare");
  CHECK(&kernels.get("queue_prepare") == &once);
  CHECK(&kernels.get("accumulate", {{1, 1}}) != &kernels.get("accumulate", {{1, 3}}));
  for (int i = 0; i < 2; ++i) CHECK_THROWS_AS(kernels.get("no such kernel"), DeviceError);
  CHECK(&kernels.get("queue_prepare") == &once);
}

TEST_CASE("a cancelled render gets the kernels that are there and waits for no other") {
  Device device;
  KernelCache kernels(device);
  std::atomic<bool> cancelled{false};
  const Kernel* once = nullptr;
  {
    const KernelCache::Interruptible interruptible(kernels, cancelled);
    once = &kernels.get("queue_prepare");
    cancelled = true;
    CHECK(&kernels.get("queue_prepare") == once);
    CHECK_THROWS_AS(kernels.get("accumulate"), RenderCancelled);
    // While another compiles: the wait ends, the compilation goes on.
    cancelled = false;
    std::thread esc([&] { cancelled = true; });
    try {
      kernels.get("camera");
    } catch (const RenderCancelled&) {
    }
    esc.join();
  }
  CHECK(kernels.get("camera").name() == "camera");
}
