// SPDX-License-Identifier: Apache-2.0
// What the files of core/gpu share: the instance, the device's function table and state, memory ranges, error checks.
#pragma once

#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gpu/device.h"

namespace hw {

// Whether HEADWATER_VALIDATION=1 asks for the validation layers on every device, whoever opens it.
bool validation_by_environment();

// Our own VkInstance. volk's global pointers serve instance-level core functions only: those are the loader's
// trampolines, the same for every instance. Extension functions are kept here, device functions in a device table.
class Instance {
 public:
  Instance(bool validation, std::atomic<std::uint64_t>* messages);  // throws DeviceError
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  VkInstance handle() const { return instance_; }
  bool debug_utils() const { return debug_utils_; }

 private:
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger_ = nullptr;
  bool debug_utils_ = false;
};

struct PhysicalDevice {
  VkPhysicalDevice handle = VK_NULL_HANDLE;
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::uint32_t queue_family = 0;
  DeviceInfo info;
};

// Best first. `instance` must outlive the handles.
std::vector<PhysicalDevice> physical_devices(const Instance& instance);

// Sets LP_NUM_THREADS while it lives (threads > 0), then puts back what was there.
class LavapipeThreads {
 public:
  explicit LavapipeThreads(int threads);
  ~LavapipeThreads();

 private:
  bool active_ = false;
  bool had_ = false;
  std::string before_;
};

// Stages of a ray tracing pipeline that read its push constant.
constexpr VkShaderStageFlags kRayPushStages = VK_SHADER_STAGE_RAYGEN_BIT_KHR | VK_SHADER_STAGE_INTERSECTION_BIT_KHR;

// One VkDeviceMemory. Small buffers share blocks: drivers allow few allocations (4096 at least) and each is slow.
struct MemoryBlock {
  VkDeviceMemory memory = VK_NULL_HANDLE;
  std::uint32_t type = 0;
  VkDeviceSize bytes = 0;
  std::byte* mapped = nullptr;
  bool dedicated = false;
  std::map<VkDeviceSize, VkDeviceSize> free;  // offset to size, never adjacent

  // A part of `wanted` bytes where there is one: its offset.
  std::optional<VkDeviceSize> take(VkDeviceSize wanted);
  void give_back(VkDeviceSize offset, VkDeviceSize part);
  bool unused() const { return free.size() == 1 && free.begin()->second == bytes; }
};

// One piece of memory that all device buffers lie in and that kernels read as a texel buffer (memory_window.cpp).
struct MemoryWindow {
  VkBuffer buffer = VK_NULL_HANDLE;
  VkBufferView words = VK_NULL_HANDLE;  // 64 bits each; on devices without a window of a few bytes, which nobody reads
  MemoryBlock* block = nullptr;         // null: there is no window
  VkDeviceAddress address = 0;
  std::atomic<bool> complete{false};  // every device buffer so far has found its place in it
};

struct MemoryRange {
  MemoryBlock* block = nullptr;
  VkDeviceSize offset = 0;
  VkDeviceSize bytes = 0;
};

struct Device::Impl {
  std::atomic<std::uint64_t> messages{0};  // before the instance: its messenger counts here
  std::unique_ptr<Instance> instance;
  PhysicalDevice physical;
  VkDevice device = VK_NULL_HANDLE;
  VolkDeviceTable vk{};
  VkQueue queue = VK_NULL_HANDLE;
  std::mutex queue_mutex;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  VkPipelineLayout ray_layout = VK_NULL_HANDLE;  // of ray tracing pipelines: a push constant and no sets
  VkDescriptorSetLayout uniform_layout = VK_NULL_HANDLE;
  VkPipelineCache cache = VK_NULL_HANDLE;
  std::string cache_path;
  VkPhysicalDeviceMemoryProperties memory_properties{};
  VkDeviceSize max_allocation = 0;
  std::uint32_t max_groups = 65535;
  bool shared_memory = false;
  bool acceleration_structures = false;
  bool ray_pipeline = false;
  bool timestamps = false;
  double timestamp_seconds = 0;  // per tick
  std::uint64_t timestamp_mask = ~0ull;
  std::atomic<bool> stage_timing{false};
  PFN_vkSetDebugUtilsObjectNameEXT set_name = nullptr;

  MemoryWindow window;

  std::mutex memory_mutex;
  std::vector<std::unique_ptr<MemoryBlock>> blocks;
  std::uint64_t bytes_in_use = 0, peak_bytes = 0, memory_limit = 0;

  std::atomic<std::uint64_t> submissions{0}, host_waits{0};
  std::mutex stage_mutex;
  std::vector<StageTime> stages;

  ~Impl();
  void name_object(VkObjectType type, std::uint64_t handle, std::string_view label) const;
  void add_stage_time(std::string_view name, double seconds, std::uint64_t calls);
  std::unique_ptr<MemoryRange> allocate(const VkMemoryRequirements& needs, BufferUse use, std::string_view label);
  void release(const MemoryRange& range);
  void make_window();
  void destroy_window();
  void load_pipeline_cache();
  void save_pipeline_cache() const;
};

// Memory types that may hold a buffer for `use`, best first.
std::vector<std::uint32_t> memory_types_for(const VkPhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                                            BufferUse use, bool shared);
void advise_large_pages(std::byte* data, std::size_t bytes);
void forget_pages(std::byte* data, std::size_t bytes);

// The SPIR-V embedded at build time under this name. Throws DeviceError when there is none. The caller destroys it.
VkShaderModule make_shader_module(const Device::Impl& device, std::string_view name);

// Turns a Vulkan result into DeviceLost, OutOfMemory or DeviceError with `what` in the sentence.
void check(VkResult result, const std::string& what);
const char* result_name(VkResult result);
std::string format_bytes(std::uint64_t bytes);  // "1.5 GiB"

}  // namespace hw
