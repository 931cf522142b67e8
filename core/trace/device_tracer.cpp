// SPDX-License-Identifier: Apache-2.0
// Acceleration structures of a scene, built and updated on the device.

#include "trace/device_tracer.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include "lib/lamp_intersect.h"
#include "trace/transform.h"

namespace hw {
namespace {

constexpr std::uint64_t kBatchBytes = 256u << 20;  // geometry uploaded before a batch of builds is run

}  // namespace

DeviceTracer::DeviceTracer(Device& device) : device_(device), build_(device) {
  VkPhysicalDeviceAccelerationStructurePropertiesKHR limits{
      VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
  VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &limits};
  vkGetPhysicalDeviceProperties2(device.physical(), &properties);
  max_instances_ = limits.maxInstanceCount;
  max_triangles_ = limits.maxPrimitiveCount;
  scratch_alignment_ = std::max(1u, limits.minAccelerationStructureScratchOffsetAlignment);
}

void DeviceTracer::set_mesh(std::uint64_t id, const TraceMesh& mesh) {
  if (mesh.indices.size() / 3 > max_triangles_)
    throw std::runtime_error("Mesh \"" + mesh.name + "\" has " + std::to_string(mesh.indices.size() / 3) +
                             " triangles, more than the " + std::to_string(max_triangles_) + " that " +
                             device_.info().name + " can hold in one mesh.");
  Mesh& entry = meshes_[id];
  entry.source = mesh;
  entry.changed = true;
  changed_ = true;
}

void DeviceTracer::remove_mesh(std::uint64_t id) {
  if (meshes_.erase(id)) changed_ = true;
}

void DeviceTracer::set_instances(std::span<const TraceInstance> instances) {
  if (instances.size() + 1 > max_instances_)
    throw std::runtime_error("The scene has " + std::to_string(instances.size()) + " instances, more than the " +
                             std::to_string(max_instances_ - 1) + " that " + device_.info().name + " can trace.");
  instances_.assign(instances.begin(), instances.end());
  changed_ = true;
}

void DeviceTracer::set_lamps(std::span<const LampShape> lamps) {
  lamps_.assign(lamps.begin(), lamps.end());
  lamps_changed_ = changed_ = true;
}

void DeviceTracer::commit() {
  if (!changed_) return;
  const auto start = std::chrono::steady_clock::now();
  build_meshes();
  if (lamps_changed_) build_lamps();
  build_top();
  lamps_changed_ = changed_ = false;
  seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TracerStats DeviceTracer::stats() const {
  std::uint64_t bytes = top_ ? top_->bytes() : 0;
  bytes += lamp_structure_ ? lamp_structure_->bytes() + lamp_table_->bytes() : 0;
  bytes += instance_table_ ? instance_table_->bytes() : 0;
  for (const auto& [id, mesh] : meshes_) bytes += mesh.structure ? mesh.structure->bytes() : 0;
  return {seconds_, bytes};
}

DeviceTracer::Push DeviceTracer::push(const TraceArgs& args) const {
  if (!top_) throw std::logic_error("A Tracer must be committed before it traces.");
  return {top_->address(),
          lamp_table_ ? lamp_table_->address() : 0,
          args.queue->address(),
          args.rays->address(),
          args.hits->address(),
          args.capacity,
          0};
}

// One scratch for all builds: the commands run one after another.
VkDeviceAddress DeviceTracer::scratch(std::uint64_t bytes) {
  if (!scratch_ || scratch_->bytes() < bytes + scratch_alignment_) {
    build_.flush();
    scratch_.reset();
    scratch_ = std::make_unique<Buffer>(device_, bytes + scratch_alignment_, BufferUse::device,
                                        "acceleration structure scratch");
  }
  return (scratch_->address() + scratch_alignment_ - 1) / scratch_alignment_ * scratch_alignment_;
}

void DeviceTracer::build_meshes() {
  std::vector<std::unique_ptr<Buffer>> inputs;
  std::uint64_t bytes = 0;
  for (auto& [id, mesh] : meshes_) {
    if (!mesh.changed) continue;
    const TraceMesh& source = mesh.source;
    mesh.structure.reset();
    if (!source.indices.empty()) try {
        inputs.push_back(device_.upload(std::as_bytes(source.positions), "build: positions of " + source.name));
        VkAccelerationStructureGeometryKHR geometry{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
        geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
        geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
        auto& triangles = geometry.geometry.triangles;
        triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR};
        triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
        triangles.vertexData.deviceAddress = inputs.back()->address();
        triangles.vertexStride = 12;
        triangles.maxVertex = static_cast<std::uint32_t>(source.positions.size() / 3 - 1);
        inputs.push_back(device_.upload(std::as_bytes(source.indices), "build: indices of " + source.name));
        triangles.indexType = VK_INDEX_TYPE_UINT32;
        triangles.indexData.deviceAddress = inputs.back()->address();
        mesh.structure = std::make_unique<AccelerationStructure>(
            device_, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, geometry,
            static_cast<std::uint32_t>(source.indices.size() / 3), false, "acceleration structure of " + source.name);
        mesh.structure->build(build_, geometry, scratch(mesh.structure->scratch_bytes(false)), false);
        bytes += source.positions.size_bytes() + source.indices.size_bytes();
      } catch (const OutOfMemory& error) {
        throw OutOfMemory("Building mesh \"" + source.name + "\": " + error.what());
      } catch (const DeviceLost&) {
        throw;
      } catch (const std::exception& error) {
        throw std::runtime_error("Building mesh \"" + source.name + "\": " + error.what());
      }
    mesh.changed = false;
    must_rebuild_ = true;
    if (bytes > kBatchBytes) {
      build_.flush();
      inputs.clear();
      bytes = 0;
    }
  }
  build_.flush();
}

void DeviceTracer::build_lamps() {
  lamp_structure_.reset();
  lamp_table_.reset();
  must_rebuild_ = true;
  const auto first = std::find_if(lamps_.begin(), lamps_.end(),
                                  [](const LampShape& lamp) { return lamp.shape != HW_LAMP_SHAPE_NONE; });
  if (first == lamps_.end()) return;
  std::vector<VkAabbPositionsKHR> boxes;
  for (const LampShape& lamp : lamps_) {
    // A lamp that is nothing gets a point inside another's box, and is never hit. Vulkan's own way to leave a box
    // out, a NaN for its x, loses the other boxes too on lavapipe of Mesa 25.0.7.
    const vec3 center = lamp.shape == HW_LAMP_SHAPE_NONE ? first->center : lamp.center, half = lamp_half_extent(lamp);
    boxes.push_back({center.x - half.x, center.y - half.y, center.z - half.z, center.x + half.x, center.y + half.y,
                     center.z + half.z});
  }
  const auto input = device_.upload(std::as_bytes(std::span(boxes)), "build: boxes of lamps");
  lamp_table_ = device_.upload(std::as_bytes(std::span(lamps_)), "lamp shapes");
  VkAccelerationStructureGeometryKHR geometry{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
  geometry.geometryType = VK_GEOMETRY_TYPE_AABBS_KHR;
  geometry.geometry.aabbs = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_AABBS_DATA_KHR};
  geometry.geometry.aabbs.data.deviceAddress = input->address();
  geometry.geometry.aabbs.stride = sizeof(VkAabbPositionsKHR);
  lamp_structure_ = std::make_unique<AccelerationStructure>(device_, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR,
                                                            geometry, static_cast<std::uint32_t>(boxes.size()), false,
                                                            "acceleration structure of lamps");
  lamp_structure_->build(build_, geometry, scratch(lamp_structure_->scratch_bytes(false)), false);
  build_.flush();
}

// An instance that can't be hit (no triangles, singular matrix) keeps its place with no structure behind it.
VkAccelerationStructureInstanceKHR DeviceTracer::record_of(const TraceInstance& instance, std::size_t index) const {
  const auto mesh = meshes_.find(instance.mesh);
  if (mesh == meshes_.end())
    throw std::runtime_error("Instance " + std::to_string(index) + " is of a mesh that does not exist.");
  VkAccelerationStructureInstanceKHR record{};
  const bool active = mesh->second.structure && invertible(instance.object_to_world);
  if (active)
    std::memcpy(&record.transform, instance.object_to_world, sizeof record.transform);
  else
    record.transform.matrix[0][0] = record.transform.matrix[1][1] = record.transform.matrix[2][2] = 1;
  record.mask = instance.mask & 0xFF;
  record.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR;
  record.accelerationStructureReference = active ? mesh->second.structure->address() : 0;
  return record;
}

void DeviceTracer::build_top() {
  std::vector<VkAccelerationStructureInstanceKHR> records;
  records.reserve(instances_.size() + 1);
  for (std::size_t i = 0; i < instances_.size(); ++i) records.push_back(record_of(instances_[i], i));
  if (lamp_structure_) {
    VkAccelerationStructureInstanceKHR record{};
    record.transform.matrix[0][0] = record.transform.matrix[1][1] = record.transform.matrix[2][2] = 1;
    record.mask = HW_MASK_LAMP;
    record.instanceShaderBindingTableRecordOffset = 1;  // their hit group in a ray tracing pipeline
    record.accelerationStructureReference = lamp_structure_->address();
    records.push_back(record);
  }
  // Structures behind the instances must be the same for an update; transforms and masks may change.
  bool update = top_ && !must_rebuild_ && top_->primitives() == records.size() && !records.empty();
  for (std::size_t i = 0; update && i < records.size(); ++i)
    update = references_[i] == records[i].accelerationStructureReference;
  references_.resize(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) references_[i] = records[i].accelerationStructureReference;

  const std::size_t bytes = records.size() * sizeof records[0];
  if (!instance_table_ || instance_table_->bytes() < bytes) {
    instance_table_.reset();
    instance_table_ = std::make_unique<Buffer>(device_, bytes, BufferUse::device, "instances of the top structure");
  }
  device_.write(*instance_table_, 0, std::as_bytes(std::span(records)));
  VkAccelerationStructureGeometryKHR geometry{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
  geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
  geometry.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
  geometry.geometry.instances.data.deviceAddress = instance_table_->address();
  if (!top_ || top_->primitives() != records.size()) {
    top_.reset();
    top_ = std::make_unique<AccelerationStructure>(device_, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, geometry,
                                                   static_cast<std::uint32_t>(records.size()), true,
                                                   "top acceleration structure");
  }
  top_->build(build_, geometry, scratch(top_->scratch_bytes(update)), update);
  build_.flush();
  must_rebuild_ = false;
}

}  // namespace hw
