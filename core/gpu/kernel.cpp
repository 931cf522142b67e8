// SPDX-License-Identifier: Apache-2.0
// Compute pipelines from the SPIR-V embedded at build time, and the pipeline cache kept between runs.

#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "gpu/impl.h"
#include "spirv_table.inc"

namespace hw {
namespace {

const SpirvEntry* find_kernel(std::string_view name) {
  for (const SpirvEntry* entry = kSpirvTable; entry->name; ++entry)
    if (name == entry->name) return entry;
  return nullptr;
}

}  // namespace

std::span<const std::uint32_t> Kernel::words(std::string_view name) {
  const SpirvEntry* entry = find_kernel(name);
  if (!entry) throw DeviceError("There is no kernel named \"" + std::string(name) + "\".");
  return {entry->words, entry->bytes / sizeof(std::uint32_t)};
}

VkShaderModule make_shader_module(const Device::Impl& d, std::string_view name) {
  const auto words = Kernel::words(name);
  VkShaderModuleCreateInfo create{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
  create.codeSize = words.size_bytes();
  create.pCode = words.data();
  VkShaderModule module = VK_NULL_HANDLE;
  check(d.vk.vkCreateShaderModule(d.device, &create, nullptr, &module), "Loading kernel \"" + std::string(name) + "\"");
  return module;
}

Kernel::Kernel(Device& device, std::string_view name, const SpecConstants& constants) : device_(device), name_(name) {
  Device::Impl& d = device.impl();
  VkShaderModule module = make_shader_module(d, name);
  std::vector<VkSpecializationMapEntry> entries;
  std::vector<std::uint32_t> values;
  for (const auto& [id, value] : constants) {
    entries.push_back({id, static_cast<std::uint32_t>(4 * values.size()), 4});
    values.push_back(value);
  }
  VkSpecializationInfo specialization{};
  specialization.mapEntryCount = static_cast<std::uint32_t>(entries.size());
  specialization.pMapEntries = entries.data();
  specialization.dataSize = 4 * values.size();
  specialization.pData = values.data();
  VkComputePipelineCreateInfo create{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
  create.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  create.stage.module = module;
  create.stage.pName = "main";
  create.stage.pSpecializationInfo = entries.empty() ? nullptr : &specialization;
  create.layout = d.layout;
  const VkResult result = d.vk.vkCreateComputePipelines(d.device, d.cache, 1, &create, nullptr, &pipeline_);
  d.vk.vkDestroyShaderModule(d.device, module, nullptr);
  check(result, "Compiling kernel \"" + name_ + "\"");
  d.name_object(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<std::uint64_t>(pipeline_), name_);
}

Kernel::~Kernel() { device_.vk().vkDestroyPipeline(device_.handle(), pipeline_, nullptr); }

// $XDG_CACHE_HOME/headwater (or ~/.cache/headwater)/pipelines-<cache UUID>.bin. A missing or unwritable folder only
// means that kernels are compiled anew. Drivers check the header themselves; we check it too, against truncated files.
void Device::Impl::load_pipeline_cache() {
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(physical.handle, &properties);
  std::filesystem::path folder;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg && *xdg == '/')
    folder = xdg;
  else if (const char* home = std::getenv("HOME"); home && *home == '/')
    folder = std::filesystem::path(home) / ".cache";
  std::vector<char> data;
  if (!folder.empty()) {
    std::string uuid;
    for (const std::uint8_t byte : properties.pipelineCacheUUID) {
      static constexpr char kHex[] = "0123456789abcdef";
      uuid += kHex[byte >> 4];
      uuid += kHex[byte & 15];
    }
    cache_path = (folder / "headwater" / ("pipelines-" + uuid + ".bin")).string();
    std::ifstream file(cache_path, std::ios::binary);
    data.assign(std::istreambuf_iterator<char>(file), {});
    VkPipelineCacheHeaderVersionOne header;
    bool valid = data.size() >= sizeof header;
    if (valid) {
      std::memcpy(&header, data.data(), sizeof header);
      valid = header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE && header.vendorID == properties.vendorID &&
              header.deviceID == properties.deviceID &&
              std::memcmp(header.pipelineCacheUUID, properties.pipelineCacheUUID, VK_UUID_SIZE) == 0;
    }
    if (!valid) data.clear();
  }
  VkPipelineCacheCreateInfo create{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
  create.initialDataSize = data.size();
  create.pInitialData = data.data();
  check(vk.vkCreatePipelineCache(device, &create, nullptr, &cache), "Making the pipeline cache");
}

void Device::Impl::save_pipeline_cache() const {
  if (cache_path.empty()) return;
  std::size_t bytes = 0;
  if (vk.vkGetPipelineCacheData(device, cache, &bytes, nullptr) != VK_SUCCESS) return;
  if (bytes <= sizeof(VkPipelineCacheHeaderVersionOne)) return;  // the driver keeps nothing there (lavapipe)
  std::error_code error;
  if (std::filesystem::file_size(cache_path, error) == bytes && !error) return;
  std::vector<char> data(bytes);
  if (vk.vkGetPipelineCacheData(device, cache, &bytes, data.data()) != VK_SUCCESS) return;
  const std::filesystem::path path(cache_path);
  std::filesystem::create_directories(path.parent_path(), error);
  // Another process may write at the same time: each writes its own file and the last rename wins.
  const std::string partial = cache_path + "." + std::to_string(getpid());
  {
    std::ofstream file(partial, std::ios::binary);
    file.write(data.data(), static_cast<std::streamsize>(bytes));
    if (!file) {
      file.close();
      std::filesystem::remove(partial, error);
      return;
    }
  }
  std::filesystem::rename(partial, path, error);
}

}  // namespace hw
