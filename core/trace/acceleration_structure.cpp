// SPDX-License-Identifier: Apache-2.0
// One Vulkan acceleration structure with its memory (VK_KHR_acceleration_structure).

#include "trace/acceleration_structure.h"

#include "gpu/impl.h"

namespace hw {

AccelerationStructure::AccelerationStructure(Device& device, VkAccelerationStructureTypeKHR type,
                                             const VkAccelerationStructureGeometryKHR& geometry,
                                             std::uint32_t primitives, bool updatable, const std::string& label)
    : device_(device),
      type_(type),
      flags_(VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR),
      primitives_(primitives) {
  if (updatable) flags_ |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR;
  VkAccelerationStructureBuildGeometryInfoKHR info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
  info.type = type_;
  info.flags = flags_;
  info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
  info.geometryCount = 1;
  info.pGeometries = &geometry;
  VkAccelerationStructureBuildSizesInfoKHR sizes{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
  device.vk().vkGetAccelerationStructureBuildSizesKHR(device.handle(), VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR,
                                                      &info, &primitives, &sizes);
  build_scratch_ = sizes.buildScratchSize;
  update_scratch_ = sizes.updateScratchSize;
  buffer_ = std::make_unique<Buffer>(device, sizes.accelerationStructureSize, BufferUse::device, label);
  VkAccelerationStructureCreateInfoKHR create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR};
  create.buffer = buffer_->handle();
  create.size = sizes.accelerationStructureSize;
  create.type = type_;
  check(device.vk().vkCreateAccelerationStructureKHR(device.handle(), &create, nullptr, &handle_), "Making " + label);
  VkAccelerationStructureDeviceAddressInfoKHR address{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR};
  address.accelerationStructure = handle_;
  address_ = device.vk().vkGetAccelerationStructureDeviceAddressKHR(device.handle(), &address);
}

AccelerationStructure::~AccelerationStructure() {
  if (handle_) device_.vk().vkDestroyAccelerationStructureKHR(device_.handle(), handle_, nullptr);
}

void AccelerationStructure::build(Commands& commands, const VkAccelerationStructureGeometryKHR& geometry,
                                  VkDeviceAddress scratch, bool update) {
  commands.record([&](VkCommandBuffer buffer) {
    VkAccelerationStructureBuildGeometryInfoKHR info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
    info.type = type_;
    info.flags = flags_;
    info.mode =
        update ? VK_BUILD_ACCELERATION_STRUCTURE_MODE_UPDATE_KHR : VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
    info.srcAccelerationStructure = update ? handle_ : VK_NULL_HANDLE;
    info.dstAccelerationStructure = handle_;
    info.geometryCount = 1;
    info.pGeometries = &geometry;
    info.scratchData.deviceAddress = scratch;
    const VkAccelerationStructureBuildRangeInfoKHR range{primitives_, 0, 0, 0};
    const VkAccelerationStructureBuildRangeInfoKHR* ranges = &range;
    device_.vk().vkCmdBuildAccelerationStructuresKHR(buffer, 1, &info, &ranges);
  });
}

}  // namespace hw
