// SPDX-License-Identifier: Apache-2.0
// One command buffer recorded, submitted and waited for at a time; barriers between commands are implied.

#include <algorithm>
#include <chrono>

#include "gpu/impl.h"
#include "shared/rays.h"

namespace hw {

struct Commands::Impl {
  static constexpr std::uint32_t kQueries = 8192;  // several waves of many stages

  Device& device;
  Device::Impl& d;
  VkCommandPool pool = VK_NULL_HANDLE;
  VkCommandBuffer buffer = VK_NULL_HANDLE;
  VkFence fence = VK_NULL_HANDLE;
  VkQueryPool queries = VK_NULL_HANDLE;
  VkDescriptorPool descriptors = VK_NULL_HANDLE;
  VkDescriptorSet uniforms = VK_NULL_HANDLE;
  VkBuffer uniform_buffers[2] = {VK_NULL_HANDLE, VK_NULL_HANDLE};
  bool uniforms_bound = false;  // in this recording
  bool recording = false;
  std::uint64_t flushes = 0;
  bool dirty = false;  // something was recorded that the next command must wait for

  // Stage marks of this recording: the stage named runs from its query to the next mark's.
  struct Mark {
    std::string name;
    bool counts;
  };
  std::vector<Mark> marks;
  std::uint32_t used_queries = kQueries;  // since their last reset
  std::string stage;
  bool stage_counts = false;  // begin_stage() was called and not yet counted

  explicit Impl(Device& owner) : device(owner), d(owner.impl()) {
    VkCommandPoolCreateInfo create{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    create.queueFamilyIndex = d.physical.queue_family;
    check(d.vk.vkCreateCommandPool(d.device, &create, nullptr, &pool), "Making a command pool");
    try {
      VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
      allocate.commandPool = pool;
      allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
      allocate.commandBufferCount = 1;
      check(d.vk.vkAllocateCommandBuffers(d.device, &allocate, &buffer), "Making a command buffer");
      VkFenceCreateInfo fence_info{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
      check(d.vk.vkCreateFence(d.device, &fence_info, nullptr, &fence), "Making a fence");
    } catch (...) {
      destroy();
      throw;
    }
  }

  ~Impl() { destroy(); }

  void destroy() {
    if (queries) d.vk.vkDestroyQueryPool(d.device, queries, nullptr);
    if (descriptors) d.vk.vkDestroyDescriptorPool(d.device, descriptors, nullptr);
    if (fence) d.vk.vkDestroyFence(d.device, fence, nullptr);
    if (pool) d.vk.vkDestroyCommandPool(d.device, pool, nullptr);
  }

  // Made for the first stage: most recordings are copies.
  void make_queries() {
    if (queries || !d.timestamps) return;
    VkQueryPoolCreateInfo create{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    create.queryType = VK_QUERY_TYPE_TIMESTAMP;
    create.queryCount = kQueries;
    check(d.vk.vkCreateQueryPool(d.device, &create, nullptr, &queries), "Making timestamp queries");
    if (recording) reset_queries();  // else begin() does
  }

  void reset_queries() {
    if (!queries) return;
    if (used_queries) d.vk.vkCmdResetQueryPool(buffer, queries, 0, used_queries);
    used_queries = 0;
  }

  void mark() {
    if (!queries || !d.stage_timing || stage.empty() || marks.size() + 1 >= kQueries) return;
    d.vk.vkCmdWriteTimestamp(buffer, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries,
                             static_cast<std::uint32_t>(marks.size()));
    marks.push_back({stage, stage_counts});
    used_queries = static_cast<std::uint32_t>(marks.size()) + 1;  // and the one that ends it
    stage_counts = false;
  }

  void begin() {
    if (recording) return;
    VkCommandBufferBeginInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(d.vk.vkBeginCommandBuffer(buffer, &info), "Recording commands");
    recording = true;
    dirty = false;
    uniforms_bound = false;
    marks.clear();
    reset_queries();
    mark();
  }

  // All that commands of ours run in.
  VkPipelineStageFlags shader_stages() const {
    VkPipelineStageFlags stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    if (d.acceleration_structures) stages |= VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_KHR;
    if (d.ray_pipeline) stages |= VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_KHR;
    return stages;
  }

  void barrier(VkPipelineStageFlags to, VkAccessFlags access) {
    VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    memory.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    memory.dstAccessMask = access;
    const VkPipelineStageFlags from = shader_stages();
    d.vk.vkCmdPipelineBarrier(buffer, from, to, 0, 1, &memory, 0, nullptr, 0, nullptr);
  }

  // Before a command: starts recording, and waits for what was recorded before. The first command of a recording waits
  // too: a fence made what earlier submissions wrote visible to the host only.
  void next() {
    begin();
    barrier(shader_stages() | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT,
            VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT);
    dirty = true;
  }

  void set_uniforms(const Buffer& root, const Buffer& frame) {
    if (uniforms_bound) {
      if (uniform_buffers[0] == root.handle() && uniform_buffers[1] == frame.handle()) return;
      flush();  // a set in use must not be written
    }
    if (!descriptors) {
      const VkDescriptorPoolSize size[2] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 2},
                                            {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1}};
      VkDescriptorPoolCreateInfo create{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
      create.maxSets = 1;
      create.poolSizeCount = 2;
      create.pPoolSizes = size;
      check(d.vk.vkCreateDescriptorPool(d.device, &create, nullptr, &descriptors), "Making a descriptor pool");
      VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
      allocate.descriptorPool = descriptors;
      allocate.descriptorSetCount = 1;
      allocate.pSetLayouts = &d.uniform_layout;
      check(d.vk.vkAllocateDescriptorSets(d.device, &allocate, &uniforms), "Making a descriptor set");
      VkWriteDescriptorSet window{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
      window.dstSet = uniforms;
      window.dstBinding = 2;
      window.descriptorCount = 1;
      window.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
      window.pTexelBufferView = &d.window.words;
      d.vk.vkUpdateDescriptorSets(d.device, 1, &window, 0, nullptr);
    }
    // Written anew for each recording: a handle may be a new buffer's that took a destroyed one's place.
    const Buffer* buffers[2] = {&root, &frame};
    for (std::uint32_t i = 0; i < 2; ++i) {
      const VkDescriptorBufferInfo range{buffers[i]->handle(), 0, std::min<VkDeviceSize>(buffers[i]->bytes(), 16384)};
      VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
      write.dstSet = uniforms;
      write.dstBinding = i;
      write.descriptorCount = 1;
      write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
      write.pBufferInfo = &range;
      d.vk.vkUpdateDescriptorSets(d.device, 1, &write, 0, nullptr);
      uniform_buffers[i] = buffers[i]->handle();
    }
  }

  static void check_push(const std::string& name, std::span<const std::byte> push) {
    if (push.size() > 128 || push.size() % 4 != 0)
      throw DeviceError("Kernel \"" + name + "\": push constants are at most 128 bytes and a multiple of 4, not " +
                        std::to_string(push.size()) + ".");
  }

  void bind(const Kernel& kernel, std::span<const std::byte> push) {
    check_push(kernel.name(), push);
    d.vk.vkCmdBindPipeline(buffer, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.pipeline());
    if (uniforms && !uniforms_bound) {
      d.vk.vkCmdBindDescriptorSets(buffer, VK_PIPELINE_BIND_POINT_COMPUTE, d.layout, 0, 1, &uniforms, 0, nullptr);
      uniforms_bound = true;
    }
    if (!push.empty())
      d.vk.vkCmdPushConstants(buffer, d.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, static_cast<std::uint32_t>(push.size()),
                              push.data());
  }

  void flush() {
    if (!recording) return;
    if (!marks.empty())
      d.vk.vkCmdWriteTimestamp(buffer, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries,
                               static_cast<std::uint32_t>(marks.size()));
    if (dirty) barrier(VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT | VK_ACCESS_HOST_WRITE_BIT);
    recording = false;
    dirty = false;
    uniforms_bound = false;
    const VkResult ended = d.vk.vkEndCommandBuffer(buffer);
    VkResult result = ended;
    const auto start = std::chrono::steady_clock::now();
    if (ended == VK_SUCCESS) {
      VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
      submit.commandBufferCount = 1;
      submit.pCommandBuffers = &buffer;
      {
        std::lock_guard lock(d.queue_mutex);
        result = d.vk.vkQueueSubmit(d.queue, 1, &submit, fence);
      }
      if (result == VK_SUCCESS) {
        ++flushes;
        ++d.submissions;
        ++d.host_waits;
        result = d.vk.vkWaitForFences(d.device, 1, &fence, VK_TRUE, UINT64_MAX);
        d.vk.vkResetFences(d.device, 1, &fence);
      }
    }
    const std::chrono::duration<double> host = std::chrono::steady_clock::now() - start;
    collect(result == VK_SUCCESS, host.count());
    d.vk.vkResetCommandPool(d.device, pool, 0);
    check(result, "Running commands on " + d.physical.info.name);
  }

  void collect(bool ran, double host_seconds) {
    if (!ran) return;
    if (!marks.empty()) {
      std::vector<std::uint64_t> ticks(marks.size() + 1);
      const VkResult result =
          d.vk.vkGetQueryPoolResults(d.device, queries, 0, static_cast<std::uint32_t>(ticks.size()), 8 * ticks.size(),
                                     ticks.data(), 8, VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
      if (result == VK_SUCCESS)
        for (std::size_t i = 0; i < marks.size(); ++i)
          d.add_stage_time(marks[i].name,
                           static_cast<double>((ticks[i + 1] - ticks[i]) & d.timestamp_mask) * d.timestamp_seconds,
                           marks[i].counts);
      marks.clear();
    } else if (d.stage_timing && !queries && !stage.empty()) {
      d.add_stage_time(stage, host_seconds, stage_counts);
      stage_counts = false;
    }
  }
};

Commands::Commands(Device& device) : impl_(std::make_unique<Impl>(device)) {}
Commands::~Commands() = default;

void Commands::set_uniforms(const Buffer& root, const Buffer& frame) { impl_->set_uniforms(root, frame); }

void Commands::dispatch(const Kernel& kernel, std::span<const std::byte> push, std::uint32_t groups_x) {
  if (groups_x == 0) return;
  if (groups_x > impl_->d.max_groups)
    throw DeviceError("Kernel \"" + kernel.name() + "\": " + std::to_string(groups_x) +
                      " workgroups are more than the " + std::to_string(impl_->d.max_groups) + " that " +
                      impl_->d.physical.info.name + " can run at once.");
  impl_->next();
  impl_->bind(kernel, push);
  impl_->d.vk.vkCmdDispatch(impl_->buffer, groups_x, 1, 1);
}

void Commands::dispatch_indirect(const Kernel& kernel, std::span<const std::byte> push, const Buffer& queue,
                                 std::size_t offset) {
  impl_->next();
  impl_->bind(kernel, push);
  impl_->d.vk.vkCmdDispatchIndirect(impl_->buffer, queue.handle(), offset);
}

void Commands::trace_rays(const RayPipeline& pipeline, std::span<const std::byte> push, const Buffer& queue,
                          std::uint32_t capacity) {
  Impl& c = *impl_;
  Impl::check_push(pipeline.name(), push);
  c.next();
  c.d.vk.vkCmdBindPipeline(c.buffer, VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, pipeline.pipeline());
  c.d.vk.vkCmdPushConstants(c.buffer, c.d.ray_layout, kRayPushStages, 0, static_cast<std::uint32_t>(push.size()),
                            push.data());
  const RayPipeline::Tables& t = pipeline.tables();
  if (c.d.physical.info.ray_pipeline_indirect)
    c.d.vk.vkCmdTraceRaysIndirectKHR(c.buffer, &t.generation, &t.miss, &t.hit, &t.callable,
                                     queue.address() + offsetof(QueueHeader, count));
  else
    c.d.vk.vkCmdTraceRaysKHR(c.buffer, &t.generation, &t.miss, &t.hit, &t.callable, capacity, 1, 1);
}

void Commands::copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
                    std::size_t bytes) {
  if (bytes == 0) return;
  impl_->next();
  const VkBufferCopy region{from_offset, to_offset, bytes};
  impl_->d.vk.vkCmdCopyBuffer(impl_->buffer, from.handle(), to.handle(), 1, &region);
}

void Commands::fill(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::uint32_t value) {
  if (bytes == 0) return;
  impl_->next();
  impl_->d.vk.vkCmdFillBuffer(impl_->buffer, buffer.handle(), offset, bytes, value);
}

void Commands::update(const Buffer& buffer, std::size_t offset, std::span<const std::byte> data) {
  if (data.empty()) return;
  impl_->next();
  impl_->d.vk.vkCmdUpdateBuffer(impl_->buffer, buffer.handle(), offset, data.size(), data.data());
}

void Commands::record(const std::function<void(VkCommandBuffer)>& fn) {
  impl_->next();
  fn(impl_->buffer);
}

void Commands::begin_stage(std::string_view name) {
  if (!impl_->d.stage_timing) return;
  impl_->make_queries();
  if (!impl_->queries || impl_->marks.size() + 2 >= Impl::kQueries) impl_->flush();
  impl_->stage = name;
  impl_->stage_counts = true;
  if (impl_->recording) impl_->mark();
}

void Commands::flush() { impl_->flush(); }
std::uint64_t Commands::flushes() const { return impl_->flushes; }

}  // namespace hw
