// SPDX-License-Identifier: Apache-2.0
// Ray tracing pipelines and their shader binding tables (Vulkan 1.3 specification, "Shader Binding Table").

#include <algorithm>
#include <cstring>

#include "gpu/impl.h"

namespace hw {
namespace {

enum Group : std::uint32_t { kGeneration, kMiss, kTriangles, kBoxes, kGroups };

VkDeviceSize align(VkDeviceSize bytes, VkDeviceSize to) { return (bytes + to - 1) / to * to; }

// Modules live until the pipeline is made.
class Stages {
 public:
  explicit Stages(Device::Impl& d) : d_(d) {}
  ~Stages() {
    for (const auto& stage : list) d_.vk.vkDestroyShaderModule(d_.device, stage.module, nullptr);
  }
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;
  // The stage's index; unused for no name.
  std::uint32_t add(VkShaderStageFlagBits kind, std::string_view name) {
    if (name.empty()) return VK_SHADER_UNUSED_KHR;
    VkPipelineShaderStageCreateInfo stage{VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
    stage.stage = kind;
    stage.module = make_shader_module(d_, name);
    stage.pName = "main";
    list.push_back(stage);
    return static_cast<std::uint32_t>(list.size() - 1);
  }
  std::vector<VkPipelineShaderStageCreateInfo> list;

 private:
  Device::Impl& d_;
};

}  // namespace

RayPipeline::RayPipeline(Device& device, std::string_view name, const RayPipelineShaders& shaders)
    : device_(device), name_(name) {
  Device::Impl& d = device.impl();
  if (!d.ray_pipeline) throw DeviceError(d.physical.info.name + " has no ray tracing pipelines.");
  Stages stages(d);
  VkRayTracingShaderGroupCreateInfoKHR groups[kGroups];
  for (auto& group : groups) {
    group = {VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR};
    group.type = VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR;
    group.generalShader = group.closestHitShader = group.anyHitShader = group.intersectionShader = VK_SHADER_UNUSED_KHR;
  }
  groups[kGeneration].generalShader = stages.add(VK_SHADER_STAGE_RAYGEN_BIT_KHR, shaders.generation);
  groups[kMiss].generalShader = stages.add(VK_SHADER_STAGE_MISS_BIT_KHR, shaders.miss);
  groups[kTriangles].type = VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR;
  groups[kBoxes].type = VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR;
  groups[kTriangles].closestHitShader = groups[kBoxes].closestHitShader =
      stages.add(VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR, shaders.closest_hit);
  groups[kBoxes].intersectionShader = stages.add(VK_SHADER_STAGE_INTERSECTION_BIT_KHR, shaders.intersection);
  VkRayTracingPipelineCreateInfoKHR create{VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR};
  create.stageCount = static_cast<std::uint32_t>(stages.list.size());
  create.pStages = stages.list.data();
  create.groupCount = kGroups;
  create.pGroups = groups;
  create.maxPipelineRayRecursionDepth = 1;
  create.layout = d.ray_layout;
  const VkResult result =
      d.vk.vkCreateRayTracingPipelinesKHR(d.device, VK_NULL_HANDLE, d.cache, 1, &create, nullptr, &pipeline_);
  check(result, "Compiling the ray tracing pipeline \"" + name_ + "\"");
  d.name_object(VK_OBJECT_TYPE_PIPELINE, reinterpret_cast<std::uint64_t>(pipeline_), name_);
  try {
    make_tables();
  } catch (...) {
    d.vk.vkDestroyPipeline(d.device, pipeline_, nullptr);
    throw;
  }
}

RayPipeline::~RayPipeline() { device_.vk().vkDestroyPipeline(device_.handle(), pipeline_, nullptr); }

// Three tables in one buffer, each begun where the device wants a table to begin: ray generation, miss, hit groups.
void RayPipeline::make_tables() {
  Device::Impl& d = device_.impl();
  VkPhysicalDeviceRayTracingPipelinePropertiesKHR limits{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &limits};
  vkGetPhysicalDeviceProperties2(d.physical.handle, &properties);
  const VkDeviceSize handle = limits.shaderGroupHandleSize, stride = align(handle, limits.shaderGroupHandleAlignment),
                     base = limits.shaderGroupBaseAlignment;
  std::vector<std::byte> handles(handle * kGroups);
  check(d.vk.vkGetRayTracingShaderGroupHandlesKHR(d.device, pipeline_, 0, kGroups, handles.size(), handles.data()),
        "Reading the shader groups of \"" + name_ + "\"");
  const VkDeviceSize miss = align(stride, base), hit = miss + align(stride, base), bytes = hit + 2 * stride;
  binding_table_ =
      std::make_unique<Buffer>(device_, bytes + base, BufferUse::device, "shader binding table of " + name_);
  const VkDeviceAddress start = align(binding_table_->address(), base);
  std::vector<std::byte> table(bytes);
  const auto put = [&](VkDeviceSize at, Group group) {
    std::memcpy(table.data() + at, handles.data() + group * handle, handle);
  };
  put(0, kGeneration);
  put(miss, kMiss);
  put(hit, kTriangles);
  put(hit + stride, kBoxes);
  device_.write(*binding_table_, start - binding_table_->address(), table);
  tables_.generation = {start, stride, stride};  // its size must be its stride
  tables_.miss = {start + miss, stride, stride};
  tables_.hit = {start + hit, stride, 2 * stride};
}

}  // namespace hw
