// SPDX-License-Identifier: Apache-2.0
// Kernels by name: found again, refused, and not waited for once a render is cancelled.
#include <doctest/doctest.h>

#include "gpu/read_constants.h"
#include "shared/features.h"
#include "stages/stage.h"

using namespace hw;

TEST_CASE("a kernel cache gives the same kernel again and refuses unknown names each time") {
  Device device;
  KernelCache kernels(device);
  const Kernel& once = kernels.get("queue_prepare");
  CHECK(&kernels.get("queue_prepare") == &once);
  for (int i = 0; i < 2; ++i) CHECK_THROWS_AS(kernels.get("no such kernel"), DeviceError);
  CHECK(&kernels.get("queue_prepare") == &once);
}

TEST_CASE("constants that a kernel does not read make no other kernel") {
  Device device;
  KernelCache kernels(device);
  // The camera looks at the passes of the film and, of the scene, at whether something lets light through at most.
  const Kernel& plain = kernels.get("camera", {{0, HW_FEATURE_SHEEN}, {1, 1}});
  CHECK(&kernels.get("camera", {{0, HW_FEATURE_COAT}, {1, 1}, {9, 4}}) == &plain);
  CHECK(&kernels.get("camera", {{0, HW_FEATURE_SHEEN}, {1, ~0u}}) != &plain);
  CHECK(&kernels.get("queue_prepare", {{0, 1}, {1, 1}}) == &kernels.get("queue_prepare"));
}

namespace {

// A module that declares constant_id 4 as %7 and a literal 0x30 as %8, then holds what is given.
std::vector<std::uint32_t> module_with(std::initializer_list<std::uint32_t> rest) {
  std::vector<std::uint32_t> words{0x07230203, 0x10500, 0, 20, 0};
  for (const std::uint32_t word : {4u << 16 | 71u, 7u, 1u, 4u,     // OpDecorate %7 SpecId 4
                                   4u << 16 | 50u, 1u, 7u, 0u,     // %7 = OpSpecConstant
                                   4u << 16 | 43u, 1u, 8u, 0x30u,  // %8 = OpConstant 0x30
                                   4u << 16 | 43u, 1u, 9u, 7u})    // %9 = OpConstant 7, which is not %7
    words.push_back(word);
  words.insert(words.end(), rest);
  return words;
}

}  // namespace

TEST_CASE("the bits of a constant that a module reads") {
  using Bits = std::map<std::uint32_t, std::uint32_t>;
  CHECK(bits_read(module_with({})) == Bits{{4, 0}});
  const std::initializer_list<std::uint32_t> masked{6u << 16 | 52u, 1, 10, 199, 7, 8};  // %10 = %7 & %8
  CHECK(bits_read(module_with(masked)) == Bits{{4, 0x30}});
  CHECK(bits_read(module_with({6u << 16 | 52u, 1, 10, 199, 8, 7})) == Bits{{4, 0x30}});
  CHECK(bits_read(module_with({6u << 16 | 52u, 1, 10, 199, 7, 7})) == Bits{{4, ~0u}});  // no literal
  CHECK(bits_read(module_with({6u << 16 | 52u, 1, 10, 198, 7, 8})) == Bits{{4, ~0u}});  // xor
  CHECK(bits_read(module_with({6u << 16 | 52u, 1, 10, 199, 7, 8, 4u << 16 | 126u, 1, 11, 7})) == Bits{{4, ~0u}});
  CHECK(bits_read(module_with({9u << 16 | 52u, 1})) == Bits{{4, ~0u}});  // cut short
  CHECK(bits_read({}).empty());
  CHECK(only_read({{4, 0x30}}, {{5, 1}, {4, 0xFF}}) == SpecConstants{{4, 0x30}});
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
