// SPDX-License-Identifier: Apache-2.0
// Buffers by address: memory types by use, small buffers packed into shared blocks, limits with clear errors.

#include <algorithm>
#include <cstring>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "gpu/impl.h"

namespace hw {
namespace {

constexpr VkDeviceSize kBlockBytes = 16u << 20;
constexpr VkDeviceSize kSmallBytes = 2u << 20;  // larger buffers have memory of their own
constexpr VkDeviceSize kAlignment = 256;        // covers every driver's buffers, acceleration structures and scratch

}  // namespace

// Memory types that may hold a buffer for `use`, best first; bit 31 of no type is set, so the array ends by count.
std::vector<std::uint32_t> memory_types_for(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                                            BufferUse use, bool shared) {
  constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  constexpr VkMemoryPropertyFlags kMapped = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  struct Candidate {
    int score;
    std::uint32_t type;
  };
  std::vector<Candidate> candidates;
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    const VkMemoryPropertyFlags flags = memory.memoryTypes[i].propertyFlags;
    if (!(allowed & (1u << i))) continue;
    if (flags & (VK_MEMORY_PROPERTY_PROTECTED_BIT | VK_MEMORY_PROPERTY_LAZILY_ALLOCATED_BIT |
                 VK_MEMORY_PROPERTY_DEVICE_COHERENT_BIT_AMD))
      continue;
    const bool mapped = (flags & kMapped) == kMapped, local = flags & kLocal, cached = flags & kCached;
    int score = 0;
    if (use == BufferUse::device && !shared) {
      score = 4 * local + !(flags & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT);  // leave the mapped window to others
    } else {
      if (!mapped) continue;
      if (use == BufferUse::device)
        score = 4 * local + 2 * cached;
      else if (use == BufferUse::readback)
        score = 4 * cached + !local;
      else
        score = shared ? 4 * local + 2 * cached : 2 * !local + !cached;
    }
    candidates.push_back({score, i});
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](auto a, auto b) { return a.score > b.score; });
  std::vector<std::uint32_t> types;
  for (const Candidate& c : candidates) types.push_back(c.type);
  return types;
}

// Asks for large pages where a CPU driver's "device" memory is fresh pages of this process: filling it by 4 KiB pages
// costs more time in page faults than in the copy. Only whole large pages inside the block, so none reaches past it.
void advise_large_pages([[maybe_unused]] std::byte* data, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  constexpr std::uintptr_t kLarge = 2u << 20;
  const std::uintptr_t begin = (reinterpret_cast<std::uintptr_t>(data) + kLarge - 1) / kLarge * kLarge;
  const std::uintptr_t end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / kLarge * kLarge;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);  // advice: may be refused
#endif
}

// Lets pages of a CPU driver's memory go that nobody needs any more: whole ones within the range.
void forget_pages([[maybe_unused]] std::byte* data, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
  constexpr std::uintptr_t kPage = 4096;
  const std::uintptr_t begin = (reinterpret_cast<std::uintptr_t>(data) + kPage - 1) / kPage * kPage;
  const std::uintptr_t end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / kPage * kPage;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);  // advice: may be refused
#endif
}

std::unique_ptr<MemoryRange> Device::Impl::allocate(const VkMemoryRequirements& needs, BufferUse use,
                                                    std::string_view label) {
  const std::string what = "buffer \"" + std::string(label) + "\" of " + format_bytes(needs.size);
  const VkDeviceSize alignment = std::max<VkDeviceSize>(kAlignment, needs.alignment);
  const VkDeviceSize bytes = (needs.size + alignment - 1) / alignment * alignment;
  std::lock_guard lock(memory_mutex);
  if (memory_limit && bytes_in_use + bytes > memory_limit)
    throw OutOfMemory("Out of memory: " + what + " does not fit: " + format_bytes(bytes_in_use) + " of the limit of " +
                      format_bytes(memory_limit) + " is in use.");
  if (max_allocation && bytes > max_allocation)
    throw OutOfMemory("Out of memory: " + what + " is larger than the " + format_bytes(max_allocation) + " that " +
                      physical.info.name + " can give in one piece.");
  const auto used = [&](MemoryBlock* block, VkDeviceSize offset) {
    bytes_in_use += bytes;
    peak_bytes = std::max(peak_bytes, bytes_in_use);
    auto range = std::make_unique<MemoryRange>();
    *range = {block, offset, bytes};
    return range;
  };
  const bool mapped = use != BufferUse::device || shared_memory;
  VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
  for (const std::uint32_t type : memory_types_for(memory_properties, needs.memoryTypeBits, use, shared_memory)) {
    const bool small = bytes <= kSmallBytes && alignment == kAlignment;
    if (window.block && window.block->type == type && use == BufferUse::device) {
      if (alignment == kAlignment)
        if (const auto offset = window.block->take(bytes)) return used(window.block, *offset);
      window.complete = false;
    }
    if (small)
      for (const auto& block : blocks) {
        if (block->dedicated || block.get() == window.block || block->type != type || (mapped && !block->mapped))
          continue;
        if (const auto offset = block->take(bytes)) return used(block.get(), *offset);
      }
    auto block = std::make_unique<MemoryBlock>();
    block->type = type;
    block->dedicated = !small;
    block->bytes = small ? kBlockBytes : bytes;
    VkMemoryAllocateFlagsInfo flags{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO};
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo info{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, &flags};
    info.allocationSize = block->bytes;
    info.memoryTypeIndex = type;
    result = vk.vkAllocateMemory(device, &info, nullptr, &block->memory);
    if (result != VK_SUCCESS) continue;
    if (mapped) {
      void* where = nullptr;
      result = vk.vkMapMemory(device, block->memory, 0, VK_WHOLE_SIZE, 0, &where);
      if (result != VK_SUCCESS) {
        vk.vkFreeMemory(device, block->memory, nullptr);
        continue;
      }
      block->mapped = static_cast<std::byte*>(where);
      if (physical.info.kind == "cpu") advise_large_pages(block->mapped, block->bytes);
    }
    if (small) block->free[bytes] = block->bytes - bytes;
    blocks.push_back(std::move(block));
    return used(blocks.back().get(), 0);
  }
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
    throw OutOfMemory("Out of memory: " + what + " does not fit on " + physical.info.name + " (" +
                      format_bytes(physical.info.memory_bytes) + " of memory, " + format_bytes(bytes_in_use) +
                      " in use by this render). Use smaller textures, fewer or simpler meshes, or another device.");
  check(result, "Allocating " + what);
  throw DeviceError("Allocating " + what + " failed.");
}

std::optional<VkDeviceSize> MemoryBlock::take(VkDeviceSize wanted) {
  const auto hole = std::find_if(free.begin(), free.end(), [&](const auto& f) { return f.second >= wanted; });
  if (hole == free.end()) return std::nullopt;
  const auto [offset, size] = *hole;
  free.erase(hole);
  if (size > wanted) free[offset + wanted] = size - wanted;
  return offset;
}

void MemoryBlock::give_back(VkDeviceSize offset, VkDeviceSize part) {
  auto it = free.emplace(offset, part).first;
  if (const auto next = std::next(it); next != free.end() && it->first + it->second == next->first) {
    it->second += next->second;
    free.erase(next);
  }
  if (it == free.begin()) return;
  const auto before = std::prev(it);
  if (before->first + before->second != it->first) return;
  before->second += it->second;
  free.erase(it);
}

void Device::Impl::release(const MemoryRange& range) {
  std::lock_guard lock(memory_mutex);
  MemoryBlock& block = *range.block;
  bytes_in_use -= range.bytes;
  if (!block.dedicated) block.give_back(range.offset, range.bytes);
  if (&block == window.block) {
    if (range.bytes > kSmallBytes) forget_pages(block.mapped + range.offset, range.bytes);
    return;
  }
  if (!block.dedicated && !block.unused()) return;
  vk.vkFreeMemory(device, block.memory, nullptr);  // unmaps too
  std::erase_if(blocks, [&](const auto& b) { return b.get() == &block; });
}

Buffer::Buffer(Device& device, std::size_t bytes, BufferUse use, std::string_view label)
    : device_(device), bytes_(bytes) {
  Device::Impl& d = device.impl();
  VkBufferCreateInfo create{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  create.size = (std::max<std::size_t>(bytes, 16) + 15) / 16 * 16;  // Vulkan has no empty buffers
  create.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT |
                 VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                 VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT;
  if (d.ray_pipeline) create.usage |= VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR;
  if (d.acceleration_structures)
    create.usage |= VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
                    VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR;
  create.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  check(d.vk.vkCreateBuffer(d.device, &create, nullptr, &buffer_),
        "Making buffer \"" + std::string(label) + "\" of " + format_bytes(create.size));
  try {
    VkMemoryRequirements needs;
    d.vk.vkGetBufferMemoryRequirements(d.device, buffer_, &needs);
    memory_ = d.allocate(needs, use, label);
    check(d.vk.vkBindBufferMemory(d.device, buffer_, memory_->block->memory, memory_->offset), "Binding buffer memory");
  } catch (...) {
    if (memory_) d.release(*memory_);
    d.vk.vkDestroyBuffer(d.device, buffer_, nullptr);
    throw;
  }
  if (memory_->block->mapped) mapped_ = memory_->block->mapped + memory_->offset;
  VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
  info.buffer = buffer_;
  address_ = d.vk.vkGetBufferDeviceAddress(d.device, &info);
  d.name_object(VK_OBJECT_TYPE_BUFFER, reinterpret_cast<std::uint64_t>(buffer_), label);
}

Buffer::~Buffer() {
  Device::Impl& d = device_.impl();
  d.vk.vkDestroyBuffer(d.device, buffer_, nullptr);
  d.release(*memory_);
}

std::unique_ptr<Buffer> Device::upload(std::span<const std::byte> data, std::string_view label) {
  auto buffer = std::make_unique<Buffer>(*this, data.size(), BufferUse::device, label);
  write(*buffer, 0, data);
  return buffer;
}

void Device::write(Buffer& buffer, std::size_t offset, std::span<const std::byte> data) {
  if (data.empty()) return;
  if (offset > buffer.bytes() || data.size() > buffer.bytes() - offset)
    throw DeviceError("Writing past the end of a buffer of " + format_bytes(buffer.bytes()) + ".");
  if (buffer.mapped()) {
    std::memcpy(buffer.as<std::byte>() + offset, data.data(), data.size());
    return;
  }
  constexpr std::size_t kChunk = 64u << 20;
  Buffer staging(*this, std::min(kChunk, data.size()), BufferUse::upload, "staging, write");
  Commands commands(*this);
  for (std::size_t done = 0; done < data.size(); done += kChunk) {
    const std::size_t bytes = std::min(kChunk, data.size() - done);
    std::memcpy(staging.mapped(), data.data() + done, bytes);
    commands.copy(staging, 0, buffer, offset + done, bytes);
    commands.flush();
  }
}

void Device::read(const Buffer& buffer, std::size_t offset, std::span<std::byte> data) {
  if (data.empty()) return;
  if (offset > buffer.bytes() || data.size() > buffer.bytes() - offset)
    throw DeviceError("Reading past the end of a buffer of " + format_bytes(buffer.bytes()) + ".");
  if (buffer.mapped()) {
    std::memcpy(data.data(), buffer.as<std::byte>() + offset, data.size());
    return;
  }
  constexpr std::size_t kChunk = 64u << 20;
  Buffer staging(*this, std::min(kChunk, data.size()), BufferUse::readback, "staging, read");
  Commands commands(*this);
  for (std::size_t done = 0; done < data.size(); done += kChunk) {
    const std::size_t bytes = std::min(kChunk, data.size() - done);
    commands.copy(buffer, offset + done, staging, 0, bytes);
    commands.flush();
    std::memcpy(data.data() + done, staging.mapped(), bytes);
  }
}

}  // namespace hw
