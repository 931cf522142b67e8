// SPDX-License-Identifier: Apache-2.0
// Finds the Vulkan loader, makes our own instance, lists and ranks devices and says why one can't be used.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "gpu/impl.h"

namespace hw {
namespace {

std::mutex& loader_mutex() {
  static std::mutex mutex;  // guards volk's process-wide loader pointers
  return mutex;
}

constexpr const char* kInstallHint =
    "install a Vulkan driver (on Debian: mesa-vulkan-drivers, which also has the CPU driver lavapipe)";

void initialize_loader() {
  if (volkGetInstanceVersion() != 0) return;
  if (volkInitialize() != VK_SUCCESS)
    throw DeviceError(
        "There is no Vulkan loader on this machine (libvulkan.so.1 was not found): install it (on Debian: libvulkan1) "
        "and " +
        std::string(kInstallHint) + ".");
}

bool has_layer(const char* name) {
  std::uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  return std::any_of(layers.begin(), layers.end(), [&](const auto& l) { return std::strcmp(l.layerName, name) == 0; });
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  static_cast<std::atomic<std::uint64_t>*>(user)->fetch_add(1);
  const char* kind = severity & VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT ? "error" : "warning";
  std::fprintf(stderr, "Vulkan validation %s: %s\n", kind, data->pMessage);
  // Tests start processes whose output nobody reads; this file gathers what all of them say.
  if (const char* path = std::getenv("HEADWATER_VALIDATION_LOG"); path && *path)
    if (std::FILE* log = std::fopen(path, "a")) {
      std::fprintf(log, "Vulkan validation %s: %s\n", kind, data->pMessage);
      std::fclose(log);
    }
  return VK_FALSE;
}

const char* kind_of(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "cpu";
    default:
      return "other";
  }
}

int rank_of(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 3;
    default:
      return 4;
  }
}

bool find_compute_queue(VkPhysicalDevice device, std::uint32_t* family) {
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  bool found = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!(families[i].queueFlags & VK_QUEUE_COMPUTE_BIT)) continue;
    // A compute-only family shares nothing with a desktop compositor: take it when there is one.
    if (!found || !(families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT)) {
      *family = i;
      found = true;
      if (!(families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT)) break;
    }
  }
  return found;
}

// For tests: HEADWATER_HIDE_EXTENSION names one that is treated as missing, or the feature of indirect launches.
bool hidden(const char* name) {
  const char* value = std::getenv("HEADWATER_HIDE_EXTENSION");
  return value && std::strcmp(value, name) == 0;
}

PhysicalDevice describe(VkPhysicalDevice handle) {
  PhysicalDevice result;
  result.handle = handle;
  VkPhysicalDeviceProperties basic;
  vkGetPhysicalDeviceProperties(handle, &basic);
  DeviceInfo& info = result.info;
  info.name = basic.deviceName;
  result.type = basic.deviceType;
  info.kind = kind_of(basic.deviceType);
  info.api_major = VK_API_VERSION_MAJOR(basic.apiVersion);
  info.api_minor = VK_API_VERSION_MINOR(basic.apiVersion);
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(handle, &memory);
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
    if (memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT)
      info.memory_bytes = std::max<std::uint64_t>(info.memory_bytes, memory.memoryHeaps[i].size);
  if (basic.apiVersion < VK_API_VERSION_1_2) {
    info.driver = std::to_string(basic.driverVersion);
    info.why_not = "its driver has Vulkan " + std::to_string(info.api_major) + "." + std::to_string(info.api_minor) +
                   ", Headwater needs 1.2.";
    info.ray_query_why_not = info.ray_pipeline_why_not = info.why_not;
    return result;
  }
  VkPhysicalDeviceDriverProperties driver{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &driver};
  vkGetPhysicalDeviceProperties2(handle, &properties);
  info.driver = std::string(driver.driverName) + " " + driver.driverInfo;

  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(handle, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(handle, nullptr, &count, extensions.data());
  const auto has = [&](const char* name) {
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
  };
  const bool structures =
      has(VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME) && has(VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME);

  VkPhysicalDeviceRayTracingPipelineFeaturesKHR pipeline{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR};
  VkPhysicalDeviceRayQueryFeaturesKHR query{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR};
  VkPhysicalDeviceAccelerationStructureFeaturesKHR structure{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR};
  VkPhysicalDeviceVulkan12Features f12{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
  VkPhysicalDeviceVulkan11Features f11{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES, &f12};
  VkPhysicalDeviceFeatures2 features{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &f11};
  void** tail = &f12.pNext;
  const auto chain = [&](auto& s) {
    *tail = &s;
    tail = &s.pNext;
  };
  if (structures) chain(structure);
  if (structures && has(VK_KHR_RAY_QUERY_EXTENSION_NAME)) chain(query);
  if (structures && has(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME)) chain(pipeline);
  vkGetPhysicalDeviceFeatures2(handle, &features);

  std::string missing;
  const auto need = [&](VkBool32 feature, const char* name) {
    if (!feature) missing += (missing.empty() ? "" : ", ") + std::string(name);
  };
  need(f12.bufferDeviceAddress, "bufferDeviceAddress");
  need(f12.scalarBlockLayout, "scalarBlockLayout");
  need(features.features.shaderInt64, "shaderInt64");
  need(f11.storageBuffer16BitAccess, "storageBuffer16BitAccess");
  need(f12.storageBuffer8BitAccess, "storageBuffer8BitAccess");
  need(find_compute_queue(handle, &result.queue_family), "a compute queue");
  info.usable = missing.empty();
  if (!info.usable) info.why_not = "its driver lacks " + missing + ".";
  info.int64_atomics = f12.shaderBufferInt64Atomics;
  const auto lacks = [&](VkBool32 feature, const char* extension) -> std::string {
    if (hidden(extension)) return "HEADWATER_HIDE_EXTENSION hides " + std::string(extension) + ".";
    if (!structures || !structure.accelerationStructure)
      return std::string("its driver lacks ") + VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME + ".";
    return feature ? "" : "its driver lacks " + std::string(extension) + ".";
  };
  info.ray_query_why_not = lacks(query.rayQuery, VK_KHR_RAY_QUERY_EXTENSION_NAME);
  info.ray_pipeline_why_not = lacks(pipeline.rayTracingPipeline, VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME);
  info.ray_query = info.ray_query_why_not.empty();
  info.ray_pipeline = info.ray_pipeline_why_not.empty();
  info.ray_pipeline_indirect = info.ray_pipeline && pipeline.rayTracingPipelineTraceRaysIndirect &&
                               !hidden("rayTracingPipelineTraceRaysIndirect");
  return result;
}

}  // namespace

LavapipeThreads::LavapipeThreads(int threads) {
  if (threads <= 0) return;
  active_ = true;
  if (const char* before = std::getenv("LP_NUM_THREADS")) {
    had_ = true;
    before_ = before;
  }
  setenv("LP_NUM_THREADS", std::to_string(threads).c_str(), 1);
}

LavapipeThreads::~LavapipeThreads() {
  if (!active_) return;
  if (had_)
    setenv("LP_NUM_THREADS", before_.c_str(), 1);
  else
    unsetenv("LP_NUM_THREADS");
}

bool validation_by_environment() {
  const char* value = std::getenv("HEADWATER_VALIDATION");
  return value && std::strcmp(value, "1") == 0;
}

Instance::Instance(bool validation, std::atomic<std::uint64_t>* messages) {
  std::lock_guard lock(loader_mutex());
  initialize_loader();
  if (volkGetInstanceVersion() < VK_API_VERSION_1_2)
    throw DeviceError(
        "The Vulkan loader of this machine is older than 1.2, which Headwater needs: update it (on Debian: "
        "libvulkan1).");
  std::vector<const char*> layers, extensions;
  if (validation) {
    if (!has_layer("VK_LAYER_KHRONOS_validation"))
      throw DeviceError(
          "Vulkan validation was asked for, but the layer VK_LAYER_KHRONOS_validation is not installed (on Debian: "
          "vulkan-validationlayers).");
    layers.push_back("VK_LAYER_KHRONOS_validation");
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);  // the layer itself has it
    debug_utils_ = true;
  }
  VkDebugUtilsMessengerCreateInfoEXT messenger{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  // Not the GENERAL type: the loader reports other people's broken drivers there.
  messenger.messageType =
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  messenger.pfnUserCallback = on_message;
  messenger.pUserData = messages;
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  application.pApplicationName = "Headwater";
  application.pEngineName = "Headwater";
  application.apiVersion = VK_API_VERSION_1_2;
  VkInstanceCreateInfo create{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  if (validation) create.pNext = &messenger;
  create.pApplicationInfo = &application;
  create.enabledLayerCount = static_cast<std::uint32_t>(layers.size());
  create.ppEnabledLayerNames = layers.data();
  create.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  const VkResult result = vkCreateInstance(&create, nullptr, &instance_);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
    throw DeviceError("This machine has no Vulkan driver: " + std::string(kInstallHint) + ".");
  check(result, "Making a Vulkan instance");
  volkLoadInstanceOnly(instance_);
  if (validation) {
    const auto create_messenger = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
    destroy_messenger_ = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
    if (create_messenger) create_messenger(instance_, &messenger, nullptr, &messenger_);
  }
}

Instance::~Instance() {
  if (messenger_ && destroy_messenger_) destroy_messenger_(instance_, messenger_, nullptr);
  if (instance_) vkDestroyInstance(instance_, nullptr);
}

std::vector<PhysicalDevice> physical_devices(const Instance& instance) {
  std::uint32_t count = 0;
  VkResult result = vkEnumeratePhysicalDevices(instance.handle(), &count, nullptr);
  // Some loaders say so only here when no driver could be loaded.
  if (result == VK_ERROR_INITIALIZATION_FAILED) return {};
  check(result, "Listing the Vulkan devices");
  std::vector<VkPhysicalDevice> handles(count);
  result = vkEnumeratePhysicalDevices(instance.handle(), &count, handles.data());
  if (result != VK_INCOMPLETE) check(result, "Listing the Vulkan devices");
  handles.resize(count);
  std::vector<PhysicalDevice> devices;
  for (VkPhysicalDevice handle : handles) devices.push_back(describe(handle));
  std::stable_sort(devices.begin(), devices.end(), [](const PhysicalDevice& a, const PhysicalDevice& b) {
    if (a.info.usable != b.info.usable) return a.info.usable;
    return rank_of(a.type) < rank_of(b.type);
  });
  return devices;
}

std::vector<DeviceInfo> list_devices(std::string* loader_error) {
  std::vector<DeviceInfo> result;
  try {
    const Instance instance(false, nullptr);
    for (PhysicalDevice& device : physical_devices(instance)) result.push_back(std::move(device.info));
    if (result.empty() && loader_error)
      *loader_error = "This machine has no Vulkan device: " + std::string(kInstallHint) + ".";
  } catch (const std::exception& error) {
    if (loader_error) *loader_error = error.what();
  }
  return result;
}

}  // namespace hw
