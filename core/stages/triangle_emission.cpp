// SPDX-License-Identifier: Apache-2.0
// Runs triangle_emission.comp.
#include "stages/triangle_emission.h"

#include <algorithm>

namespace hw {

namespace {

constexpr std::size_t kPoints = 1u << 18;     // of one submission: a program can be slow
constexpr std::size_t kMostCells = 1u << 30;  // of one buffer: cells are counted in 32 bits

}  // namespace

std::vector<float> measure_emission(Device& device, KernelCache& kernels, const Buffer& root, const Buffer& frame,
                                    const SpecConstants& constants, std::span<const std::uint32_t> lights,
                                    std::uint32_t size, std::uint32_t taps, const std::atomic<bool>& cancelled) {
  const std::size_t cells = std::size_t{size} * size;
  std::vector<float> out;
  out.reserve(lights.size() * cells);
  const Kernel& kernel = kernels.get("triangle_emission", constants);
  const std::size_t at_once = std::max<std::size_t>(kPoints / (std::size_t{taps} * taps), HW_GROUP_SIZE);
  while (!lights.empty()) {
    const auto part = lights.first(std::min(lights.size(), kMostCells / cells));
    lights = lights.subspan(part.size());
    const std::size_t count = part.size() * cells, before = out.size();
    const auto which = device.upload(std::as_bytes(part), "lights to measure");
    Buffer grid(device, count * sizeof(float), BufferUse::device, "emission of triangles");
    Commands commands(device);
    commands.begin_stage("emission");
    commands.set_uniforms(root, frame);
    for (std::size_t first = 0; first < count; first += at_once) {
      if (cancelled) throw RenderCancelled{};
      const std::size_t last = std::min(count, first + at_once);
      Push push{.queue = grid.address(),
                .out_queue = which->address(),
                .a = static_cast<std::uint32_t>(last),
                .b = size,
                .c = taps,
                .d = static_cast<std::uint32_t>(first)};
      commands.dispatch(kernel, push.bytes(),
                        static_cast<std::uint32_t>((last - first + HW_GROUP_SIZE - 1) / HW_GROUP_SIZE));
      commands.flush();
    }
    out.resize(before + count);
    device.read(grid, 0, std::as_writable_bytes(std::span(out).subspan(before)));
  }
  return out;
}

}  // namespace hw
