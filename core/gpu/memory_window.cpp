// SPDX-License-Identifier: Apache-2.0
// The memory window: one piece of address space for all device buffers, which kernels also see as one texel buffer.
//
// Lavapipe before Mesa 24 makes of each load by address a loop over the lanes, with a branch each; texels it fetches
// for all lanes at once. So kernels there read by texel what they know the address of (shaders/lib/words.glsl), at a
// fifth of the cost. Pages are only taken where buffers lie, and given back with them. A buffer that finds no place
// lies elsewhere and ends the window: kernels made from then on read by address, as they do on all other devices.

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "gpu/impl.h"

namespace hw {
namespace {

constexpr VkDeviceSize kWindowBytes = 1u << 30;  // what the least texel limit of 2^27 words of 64 bits comes to
constexpr VkDeviceSize kNoWindowBytes = 256;
constexpr int kGathers = 24;  // the first Mesa whose lavapipe loads by address without a loop

// Bytes of the window where loads by address are slow, else 0. HEADWATER_MEMORY_WINDOW, in MiB, decides otherwise, for
// measurements and tests.
VkDeviceSize window_bytes(const DeviceInfo& info) {
  if (const char* given = std::getenv("HEADWATER_MEMORY_WINDOW"); given && *given)
    return std::min<VkDeviceSize>(std::strtoull(given, nullptr, 10) << 20, kWindowBytes);
  constexpr std::string_view kMesa = "Mesa ";
  const std::size_t at = info.driver.find(kMesa);
  if (info.kind != "cpu" || !info.driver.starts_with("llvmpipe") || at == std::string::npos) return 0;
  return std::atoi(info.driver.c_str() + at + kMesa.size()) < kGathers ? kWindowBytes : 0;
}

}  // namespace

void Device::Impl::make_window() {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(physical.handle, &properties);
  VkDeviceSize bytes =
      std::min<VkDeviceSize>(window_bytes(physical.info), 8ull * properties.limits.maxTexelBufferElements);
  if (max_allocation) bytes = std::min(bytes, max_allocation);
  bool windowed = shared_memory && bytes > 0;
  const auto make = [&](VkDeviceSize size) {
    VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    create.size = size;
    create.usage = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    check(vk.vkCreateBuffer(device, &create, nullptr, &window.buffer), "Making the memory window");
    VkMemoryRequirements needs;
    vk.vkGetBufferMemoryRequirements(device, window.buffer, &needs);
    auto block = std::make_unique<MemoryBlock>();
    const auto types = memory_types_for(memory_properties, needs.memoryTypeBits, BufferUse::device, shared_memory);
    if (types.empty()) return false;
    block->type = types.front();
    block->bytes = needs.size;
    VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO};
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, &flags};
    info.allocationSize = block->bytes;
    info.memoryTypeIndex = block->type;
    if (vk.vkAllocateMemory(device, &info, nullptr, &block->memory) != VK_SUCCESS) return false;
    blocks.push_back(std::move(block));
    return true;
  };
  if (windowed && !make(bytes)) {
    vk.vkDestroyBuffer(device, window.buffer, nullptr);
    windowed = false;
  }
  if (!windowed && !make(kNoWindowBytes))
    throw OutOfMemory("Out of memory: not even a small buffer fits on the device.");
  MemoryBlock& block = *blocks.back();
  block.dedicated = !windowed;
  check(vk.vkBindBufferMemory(device, window.buffer, block.memory, 0), "Binding the memory window");
  VkBufferViewCreateInfo view{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
  view.buffer = window.buffer;
  view.format = VK_FORMAT_R32G32_UINT;
  view.range = VK_WHOLE_SIZE;
  check(vk.vkCreateBufferView(device, &view, nullptr, &window.words), "Making the memory window's view");
  if (!windowed) return;
  void* where = nullptr;
  check(vk.vkMapMemory(device, block.memory, 0, VK_WHOLE_SIZE, 0, &where), "Mapping the memory window");
  block.mapped = static_cast<std::byte*>(where);
  advise_large_pages(block.mapped, block.bytes);
  VkBufferDeviceAddressInfo address{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
  address.buffer = window.buffer;
  window.address = vk.vkGetBufferDeviceAddress(device, &address);
  block.free[0] = block.bytes;
  window.block = &block;
  window.complete = true;
}

// The block is freed with the others.
void Device::Impl::destroy_window() {
  if (window.words) vk.vkDestroyBufferView(device, window.words, nullptr);
  if (window.buffer) vk.vkDestroyBuffer(device, window.buffer, nullptr);
}

bool Device::windowed() const { return impl_->window.complete; }

SpecConstants Device::window_constants() const {
  if (!windowed()) return {};
  return {{30, 1}};
}

std::uint32_t Device::window_begin() const { return static_cast<std::uint32_t>(impl_->window.address); }

}  // namespace hw
