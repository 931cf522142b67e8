// SPDX-License-Identifier: Apache-2.0
// What both Tracers on the device share: the scene in acceleration structures (VK_KHR_acceleration_structure). A bottom
// structure per mesh, one of boxes for the lamps, and a top structure of instances whose last entry is the lamps'.
#pragma once

#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "trace/acceleration_structure.h"
#include "trace/tracer.h"

namespace hw {

class DeviceTracer : public Tracer {
 public:
  bool runs_on_host() const final { return false; }
  void set_mesh(std::uint64_t id, const TraceMesh& mesh) final;
  void remove_mesh(std::uint64_t id) final;
  void set_instances(std::span<const TraceInstance> instances) final;
  void set_lamps(std::span<const LampShape> lamps) final;
  void commit() final;
  TracerStats stats() const final;

 protected:
  explicit DeviceTracer(Device& device);  // which must have acceleration structures

  // Same layout as the push constant of shaders/lib/trace_io.glsl.
  struct Push {
    std::uint64_t structure, lamps, queue, rays, hits;
    std::uint32_t capacity, pad;
    std::span<const std::byte> bytes() const { return std::as_bytes(std::span(this, 1)); }
  };
  Push push(const TraceArgs& args) const;  // throws std::logic_error before the first commit()

 private:
  struct Mesh {
    TraceMesh source;
    bool changed = true;
    std::unique_ptr<AccelerationStructure> structure;  // null for a mesh without triangles
  };

  VkDeviceAddress scratch(std::uint64_t bytes);
  void build_meshes();
  void build_lamps();
  VkAccelerationStructureInstanceKHR record_of(const TraceInstance& instance, std::size_t index) const;
  void build_top();

  Device& device_;
  Commands build_;
  std::uint64_t max_instances_ = 0, max_triangles_ = 0, scratch_alignment_ = 1;
  std::unordered_map<std::uint64_t, Mesh> meshes_;
  std::vector<TraceInstance> instances_;
  std::vector<LampShape> lamps_;
  std::vector<VkDeviceAddress> references_;  // behind each entry of the top structure
  std::unique_ptr<AccelerationStructure> lamp_structure_, top_;
  std::unique_ptr<Buffer> lamp_table_, instance_table_, scratch_;
  bool changed_ = true, lamps_changed_ = false;
  bool must_rebuild_ = true;  // a structure under the top one is new
  double seconds_ = 0;
};

}  // namespace hw
