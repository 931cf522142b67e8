// SPDX-License-Identifier: Apache-2.0
// Chooses a Vulkan device, makes the logical device with what Headwater needs, and keeps its stage times.

#include "gpu/device.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "gpu/impl.h"

namespace hw {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

bool matches(const PhysicalDevice& device, std::size_t index, const std::string& wanted) {
  if (wanted.empty()) return true;
  if (wanted == "gpu")
    return device.info.kind == "discrete" || device.info.kind == "integrated" || device.info.kind == "virtual";
  if (wanted == device.info.kind) return true;
  if (wanted == std::to_string(index)) return true;
  return lower(device.info.name).find(wanted) != std::string::npos;
}

std::string describe_all(const std::vector<PhysicalDevice>& devices) {
  std::string text;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const DeviceInfo& info = devices[i].info;
    text += "\n  " + std::to_string(i) + ": " + info.name + " (" + info.kind + ", " + info.driver + ")";
    if (!info.usable) text += ": can't be used, " + info.why_not;
  }
  return text;
}

PhysicalDevice choose(const std::vector<PhysicalDevice>& devices, const std::string& name) {
  if (devices.empty())
    throw DeviceError(
        "This machine has no Vulkan device: install a driver for its GPU or, to render on the CPU, lavapipe (on "
        "Debian: "
        "mesa-vulkan-drivers).");
  const std::string wanted = lower(name);
  const PhysicalDevice* unusable = nullptr;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (!matches(devices[i], i, wanted)) continue;
    if (devices[i].info.usable) return devices[i];
    if (!unusable) unusable = &devices[i];
  }
  std::string text;
  if (unusable && !wanted.empty())
    text = "Device \"" + name + "\" (" + unusable->info.name + ") can't be used: " + unusable->info.why_not;
  else if (!wanted.empty())
    text = "There is no device \"" + name + "\".";
  else
    text = "No Vulkan device of this machine can be used.";
  throw DeviceError(text + " Devices:" + describe_all(devices));
}

VkDevice make_device(const PhysicalDevice& physical) {
  const float priority = 1.0f;
  VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
  queue.queueFamilyIndex = physical.queue_family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkPhysicalDeviceRayQueryFeaturesKHR query{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR};
  query.rayQuery = VK_TRUE;
  VkPhysicalDeviceRayTracingPipelineFeaturesKHR pipeline{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR};
  pipeline.rayTracingPipeline = VK_TRUE;
  pipeline.rayTracingPipelineTraceRaysIndirect = physical.info.ray_pipeline_indirect;
  VkPhysicalDeviceAccelerationStructureFeaturesKHR structure{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR};
  structure.accelerationStructure = VK_TRUE;
  VkPhysicalDeviceVulkan12Features f12{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
  f12.bufferDeviceAddress = VK_TRUE;
  f12.scalarBlockLayout = VK_TRUE;
  f12.storageBuffer8BitAccess = VK_TRUE;
  f12.shaderBufferInt64Atomics = physical.info.int64_atomics;
  VkPhysicalDeviceVulkan11Features f11{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES, &f12};
  f11.storageBuffer16BitAccess = VK_TRUE;
  VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &f11};
  features.features.shaderInt64 = VK_TRUE;
  std::vector<const char*> extensions;
  if (physical.info.ray_query || physical.info.ray_pipeline) {
    f12.pNext = &structure;
    extensions = {VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME, VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME};
  }
  if (physical.info.ray_query) {
    query.pNext = std::exchange(structure.pNext, &query);
    extensions.push_back(VK_KHR_RAY_QUERY_EXTENSION_NAME);
  }
  if (physical.info.ray_pipeline) {
    pipeline.pNext = std::exchange(structure.pNext, &pipeline);
    extensions.push_back(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME);
  }
  VkDeviceCreateInfo create{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features};
  create.queueCreateInfoCount = 1;
  create.pQueueCreateInfos = &queue;
  create.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  VkDevice device = VK_NULL_HANDLE;
  check(vkCreateDevice(physical.handle, &create, nullptr, &device), "Opening the device " + physical.info.name);
  return device;
}

}  // namespace

const char* result_name(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "initialization failed";
    case VK_ERROR_DEVICE_LOST:
      return "device lost";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "layer not present";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
      return "extension not present";
    case VK_ERROR_FEATURE_NOT_PRESENT:
      return "feature not present";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "incompatible driver";
    case VK_ERROR_TOO_MANY_OBJECTS:
      return "too many objects";
    default:
      return "unknown error";
  }
}

void check(VkResult result, const std::string& what) {
  if (result >= 0) return;
  const std::string text = what + " failed: " + result_name(result) + " (VkResult " + std::to_string(result) + ").";
  if (result == VK_ERROR_DEVICE_LOST)
    throw DeviceLost(
        text + " The driver gave up on the device (a hang, a reset, or it was unplugged); start the render again.");
  if (result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY) throw OutOfMemory(text);
  throw DeviceError(text);
}

std::string format_bytes(std::uint64_t bytes) {
  static constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  int unit = 0;
  while (value >= 1024 && unit < 4) value /= 1024, ++unit;
  char text[32];
  std::snprintf(text, sizeof text, unit == 0 ? "%.0f %s" : "%.1f %s", value, kUnits[unit]);
  return text;
}

Device::Device(const std::string& name, bool validation, int threads) : impl_(std::make_unique<Impl>()) {
  Impl& d = *impl_;
  {
    static std::mutex mutex;  // the environment is the process's
    std::lock_guard lock(mutex);
    const LavapipeThreads environment(threads);
    d.instance = std::make_unique<Instance>(validation || validation_by_environment(), &d.messages);
    d.physical = choose(physical_devices(*d.instance), name);
    d.device = make_device(d.physical);
  }
  volkLoadDeviceTable(&d.vk, d.device);
  d.vk.vkGetDeviceQueue(d.device, d.physical.queue_family, 0, &d.queue);
  d.ray_pipeline = d.physical.info.ray_pipeline;
  d.acceleration_structures = d.ray_pipeline || d.physical.info.ray_query;
  if (d.instance->debug_utils())
    d.set_name = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
        vkGetInstanceProcAddr(d.instance->handle(), "vkSetDebugUtilsObjectNameEXT"));

  VkPhysicalDeviceMaintenance3Properties maintenance{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &maintenance};
  vkGetPhysicalDeviceProperties2(d.physical.handle, &properties);
  d.max_allocation = maintenance.maxMemoryAllocationSize;
  d.max_groups = properties.properties.limits.maxComputeWorkGroupCount[0];
  vkGetPhysicalDeviceMemoryProperties(d.physical.handle, &d.memory_properties);
  std::uint32_t count = d.physical.queue_family + 1;
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(d.physical.handle, &count, families.data());
  const std::uint32_t bits = families[d.physical.queue_family].timestampValidBits;
  d.timestamps = bits > 0 && properties.properties.limits.timestampPeriod > 0;
  d.timestamp_seconds = properties.properties.limits.timestampPeriod * 1e-9;
  d.timestamp_mask = bits >= 64 ? ~0ull : (1ull << bits) - 1;
  d.stage_timing = d.timestamps;

  const bool unified =
      d.physical.type == VK_PHYSICAL_DEVICE_TYPE_CPU || d.physical.type == VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU;
  constexpr VkMemoryPropertyFlags kShared =
      VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  for (std::uint32_t i = 0; i < d.memory_properties.memoryTypeCount; ++i)
    if (unified && (d.memory_properties.memoryTypes[i].propertyFlags & kShared) == kShared) d.shared_memory = true;
  // For tests on machines without a GPU: treat memory as the device's own, so that staging and readback run.
  if (const char* own = std::getenv("HEADWATER_OWN_MEMORY"); own && *own == '1') d.shared_memory = false;

  // The two structs that every kernel reads all the time, the scene's root and the frame's parameters, are uniform
  // buffers: lavapipe loads a uniform once for all lanes, and an address once for each. The third is the memory window
  // (memory_window.cpp).
  const VkDescriptorSetLayoutBinding uniforms[3] = {
      {0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr},
      {1, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr},
      {2, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr}};
  VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
  set.bindingCount = 3;
  set.pBindings = uniforms;
  check(d.vk.vkCreateDescriptorSetLayout(d.device, &set, nullptr, &d.uniform_layout), "Making the descriptor layout");
  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, 128};
  VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &d.uniform_layout;
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &push;
  check(d.vk.vkCreatePipelineLayout(d.device, &layout, nullptr, &d.layout), "Making the pipeline layout");
  if (d.ray_pipeline) {
    const VkPushConstantRange rays{kRayPushStages, 0, 128};
    layout.setLayoutCount = 0;
    layout.pPushConstantRanges = &rays;
    check(d.vk.vkCreatePipelineLayout(d.device, &layout, nullptr, &d.ray_layout), "Making the ray pipeline layout");
  }
  d.load_pipeline_cache();
  d.make_window();
}

Device::~Device() = default;

Device::Impl::~Impl() {
  if (device) {
    vk.vkDeviceWaitIdle(device);
    if (cache) {
      save_pipeline_cache();
      vk.vkDestroyPipelineCache(device, cache, nullptr);
    }
    destroy_window();
    if (layout) vk.vkDestroyPipelineLayout(device, layout, nullptr);
    if (ray_layout) vk.vkDestroyPipelineLayout(device, ray_layout, nullptr);
    if (uniform_layout) vk.vkDestroyDescriptorSetLayout(device, uniform_layout, nullptr);
    for (const auto& block : blocks) vk.vkFreeMemory(device, block->memory, nullptr);
    vk.vkDestroyDevice(device, nullptr);
  }
}

void Device::Impl::name_object(VkObjectType type, std::uint64_t handle, std::string_view label) const {
  if (!set_name) return;
  const std::string text(label);
  VkDebugUtilsObjectNameInfoEXT info{VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT};
  info.objectType = type;
  info.objectHandle = handle;
  info.pObjectName = text.c_str();
  set_name(device, &info);
}

void Device::Impl::add_stage_time(std::string_view name, double seconds, std::uint64_t calls) {
  std::lock_guard lock(stage_mutex);
  for (StageTime& stage : stages)
    if (stage.name == name) {
      stage.seconds += seconds;
      stage.calls += calls;
      return;
    }
  stages.push_back({std::string(name), seconds, calls});
}

const DeviceInfo& Device::info() const { return impl_->physical.info; }
bool Device::shared_memory() const { return impl_->shared_memory; }
VkDevice Device::handle() const { return impl_->device; }
VkPhysicalDevice Device::physical() const { return impl_->physical.handle; }
const VolkDeviceTable& Device::vk() const { return impl_->vk; }
VkPipelineLayout Device::pipeline_layout() const { return impl_->layout; }
std::uint32_t Device::max_groups() const { return impl_->max_groups; }
std::uint64_t Device::validation_messages() const { return impl_->messages; }
void Device::set_stage_timing(bool on) { impl_->stage_timing = on; }
void Device::add_stage_time(std::string_view name, double seconds) { impl_->add_stage_time(name, seconds, 1); }

std::uint64_t Device::bytes_in_use() const {
  std::lock_guard lock(impl_->memory_mutex);
  return impl_->bytes_in_use;
}

std::uint64_t Device::peak_bytes() const {
  std::lock_guard lock(impl_->memory_mutex);
  return impl_->peak_bytes;
}

void Device::set_memory_limit(std::uint64_t bytes) {
  std::lock_guard lock(impl_->memory_mutex);
  impl_->memory_limit = bytes;
}

std::vector<StageTime> Device::stage_times() const {
  std::lock_guard lock(impl_->stage_mutex);
  return impl_->stages;
}

std::uint64_t Device::submissions() const { return impl_->submissions; }
std::uint64_t Device::host_waits() const { return impl_->host_waits; }

void Device::reset_stage_times() {
  std::lock_guard lock(impl_->stage_mutex);
  impl_->stages.clear();
  impl_->submissions = impl_->host_waits = 0;
}

}  // namespace hw
