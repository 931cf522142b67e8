// SPDX-License-Identifier: Apache-2.0
// One Vulkan acceleration structure with its memory: created at the size a build needs, built or updated in place.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "gpu/device.h"

namespace hw {

class AccelerationStructure {
 public:
  // `geometry` with `primitives` primitives. `updatable` structures can be updated in place later.
  AccelerationStructure(Device& device, VkAccelerationStructureTypeKHR type,
                        const VkAccelerationStructureGeometryKHR& geometry, std::uint32_t primitives, bool updatable,
                        const std::string& label);
  ~AccelerationStructure();
  AccelerationStructure(const AccelerationStructure&) = delete;
  AccelerationStructure& operator=(const AccelerationStructure&) = delete;

  VkDeviceAddress address() const { return address_; }
  std::uint64_t bytes() const { return buffer_->bytes(); }
  std::uint32_t primitives() const { return primitives_; }
  std::uint64_t scratch_bytes(bool update) const { return update ? update_scratch_ : build_scratch_; }

  // Records the build; inputs and scratch must live until the commands are flushed.
  void build(Commands& commands, const VkAccelerationStructureGeometryKHR& geometry, VkDeviceAddress scratch,
             bool update);

 private:
  Device& device_;
  VkAccelerationStructureTypeKHR type_;
  VkBuildAccelerationStructureFlagsKHR flags_;
  std::uint32_t primitives_;
  std::uint64_t build_scratch_ = 0, update_scratch_ = 0;
  std::unique_ptr<Buffer> buffer_;
  VkAccelerationStructureKHR handle_ = VK_NULL_HANDLE;
  VkDeviceAddress address_ = 0;
};

}  // namespace hw
