// SPDX-License-Identifier: Apache-2.0
// Runs world_luminance.comp.
#include "stages/world_luminance.h"

#include <algorithm>

namespace hw {

namespace {

constexpr std::uint32_t kCells = 1u << 16;  // of one submission: a world's program can be slow

}  // namespace

std::vector<float> measure_world(Device& device, KernelCache& kernels, const Buffer& root, const Buffer& frame,
                                 const SpecConstants& constants, std::uint32_t width, std::uint32_t height,
                                 const std::atomic<bool>& cancelled) {
  const std::size_t count = std::size_t(width) * height;
  Buffer grid(device, count * 4, BufferUse::device, "world luminance");
  Commands commands(device);
  commands.begin_stage("world");
  commands.set_uniforms(root, frame);
  // A fine map has a cell a texel, near enough; in a coarse one a small bright light could hide between the samples.
  const std::uint32_t across = width > 512 ? 1 : 2;
  const Kernel& kernel = kernels.get("world_luminance", constants);
  for (std::size_t first = 0; first < count; first += kCells) {
    if (cancelled) throw RenderCancelled{};
    Push push{.queue = grid.address(), .a = width, .b = height, .c = across, .d = static_cast<std::uint32_t>(first)};
    const std::size_t cells = std::min<std::size_t>(kCells, count - first);
    commands.dispatch(kernel, push.bytes(), static_cast<std::uint32_t>((cells + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE));
    commands.flush();
  }
  std::vector<float> out(count);
  device.read(grid, 0, std::as_writable_bytes(std::span(out)));
  return out;
}

}  // namespace hw
