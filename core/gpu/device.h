// SPDX-License-Identifier: Apache-2.0
// Thin Vulkan: one instance and device of our own, buffers by address, compute pipelines, one submission at a time.
// Tables are reached by address; two structs that hold those addresses, the scene's root and the frame's parameters,
// are uniform buffers 0 and 1 of descriptor set 0.
#pragma once

#include <volk.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hw {

struct DeviceInfo {
  std::string name;    // as the driver says it
  std::string driver;  // name and version
  std::string kind;    // "discrete", "integrated", "cpu", "virtual", "other"
  std::uint32_t api_major = 0, api_minor = 0;
  std::uint64_t memory_bytes = 0;
  bool usable = false;  // has all that Headwater needs
  std::string why_not;  // when not usable: what is missing, in a sentence
  bool ray_query = false;
  bool ray_pipeline = false;
  bool ray_pipeline_indirect = false;                   // launches whose size the device decides
  std::string ray_query_why_not, ray_pipeline_why_not;  // what is missing, in a sentence; empty where it is there
  bool int64_atomics = false;  // on 64-bit numbers in buffers: what world-space reservoirs are fed by
};

// Errors a user can act on. DeviceLost and OutOfMemory end the render; the session can be built again.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct DeviceLost : DeviceError {
  using DeviceError::DeviceError;
};
struct OutOfMemory : DeviceError {
  using DeviceError::DeviceError;
};

// All Vulkan devices of the machine, best first (discrete, integrated, virtual, cpu). Never throws: an empty list and
// `loader_error` when there is no Vulkan loader or driver at all.
std::vector<DeviceInfo> list_devices(std::string* loader_error = nullptr);

class Device;
struct MemoryRange;  // a part of a device memory block

enum class BufferUse {
  device,    // lives on the device; mapped too where memory is shared (CPU and integrated devices)
  upload,    // host-written, device-read, always mapped
  readback,  // device-written, host-read, always mapped and cached
};

// A storage buffer known by its address. `mapped` is null on a device with its own memory (BufferUse::device).
class Buffer {
 public:
  Buffer(Device& device, std::size_t bytes, BufferUse use, std::string_view label);
  ~Buffer();
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  std::size_t bytes() const { return bytes_; }
  VkDeviceAddress address() const { return address_; }
  VkBuffer handle() const { return buffer_; }
  void* mapped() const { return mapped_; }
  template <class T>
  T* as() const {
    return static_cast<T*>(mapped_);
  }

 private:
  Device& device_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  std::unique_ptr<MemoryRange> memory_;
  void* mapped_ = nullptr;
  VkDeviceAddress address_ = 0;
  std::size_t bytes_ = 0;
};

using SpecConstants = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  // constant_id, value

// A compute kernel. Kernels are found by name among the SPIR-V embedded at build time ("camera" for camera.comp).
class Kernel {
 public:
  Kernel(Device& device, std::string_view name, const SpecConstants& constants = {});
  ~Kernel();
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;
  // The SPIR-V of that name. Throws DeviceError where there is none.
  static std::span<const std::uint32_t> words(std::string_view name);
  VkPipeline pipeline() const { return pipeline_; }
  const std::string& name() const { return name_; }

 private:
  Device& device_;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  std::string name_;
};

// The shaders of a ray tracing pipeline, by the names of their SPIR-V ("pipeline_any_rgen" for pipeline_any.rgen). Hit
// group 0 is for opaque triangles, hit group 1 for boxes with the intersection shader; `closest_hit`, which may be
// empty, is both groups'.
struct RayPipelineShaders {
  std::string_view generation, miss, closest_hit, intersection;
};

// A ray tracing pipeline and its shader binding table (VK_KHR_ray_tracing_pipeline). Shaders don't trace from hits: a
// recursion depth of 1, which every device has. Throws DeviceError on a device without info().ray_pipeline.
class RayPipeline {
 public:
  RayPipeline(Device& device, std::string_view name, const RayPipelineShaders& shaders);
  ~RayPipeline();
  RayPipeline(const RayPipeline&) = delete;
  RayPipeline& operator=(const RayPipeline&) = delete;
  VkPipeline pipeline() const { return pipeline_; }
  const std::string& name() const { return name_; }
  struct Tables {
    VkStridedDeviceAddressRegionKHR generation{}, miss{}, hit{}, callable{};
  };
  const Tables& tables() const { return tables_; }

 private:
  void make_tables();
  Device& device_;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
  std::string name_;
  std::unique_ptr<Buffer> binding_table_;
  Tables tables_;
};

// Records work and submits it. Barriers between dispatches are implied (each waits for the one before).
class Commands {
 public:
  explicit Commands(Device& device);
  ~Commands();
  // Uniform buffers of the dispatches that follow (their first 16 KiB at most). They outlive the flush.
  void set_uniforms(const Buffer& root, const Buffer& frame);
  // `push` is at most 128 bytes: what the stage needs besides the uniforms.
  void dispatch(const Kernel& kernel, std::span<const std::byte> push, std::uint32_t groups_x);
  // Groups from a QueueHeader at `offset` in `queue`.
  void dispatch_indirect(const Kernel& kernel, std::span<const std::byte> push, const Buffer& queue,
                         std::size_t offset = 0);
  // A ray a path of `queue`, whose header has the launch's size; `capacity` rays on a device that can't read it there.
  // `push` is at most 128 bytes, for ray generation and intersection shaders.
  void trace_rays(const RayPipeline& pipeline, std::span<const std::byte> push, const Buffer& queue,
                  std::uint32_t capacity);
  void copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset, std::size_t bytes);
  void fill(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::uint32_t value);
  // Writes `data`, kept in the recording, in its turn: at most 64 KiB, sizes and offset multiples of 4.
  void update(const Buffer& buffer, std::size_t offset, std::span<const std::byte> data);
  // For Tracers that record their own commands (acceleration structure builds).
  void record(const std::function<void(VkCommandBuffer)>& fn);
  void begin_stage(std::string_view name);  // what follows is timed under this name
  void flush();                             // submit what was recorded and wait; throws DeviceLost / OutOfMemory
  std::uint64_t flushes() const;            // that submitted something, since construction
  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

struct StageTime {
  std::string name;
  double seconds;
  std::uint64_t calls;
};

class Device {
 public:
  // `name`: empty for the best usable device, else a part of a device's name (any case), its index, or one of
  // "gpu"/"discrete"/"integrated"/"cpu". Throws DeviceError listing the devices and why each can't be used.
  // `threads`: host threads a CPU device may use, 0 for the driver's choice (lavapipe reads LP_NUM_THREADS when the
  // instance enumerates its devices; the variable is set for that time only, and not while other Devices are made).
  // `validation`: Khronos' layer, also turned on by HEADWATER_VALIDATION=1. Its messages go to stderr, and are appended
  // to the file that HEADWATER_VALIDATION_LOG names.
  explicit Device(const std::string& name = {}, bool validation = false, int threads = 0);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const DeviceInfo& info() const;
  bool shared_memory() const;  // device buffers are mapped: the host sees them without a copy
  VkDevice handle() const;
  VkPhysicalDevice physical() const;
  const VolkDeviceTable& vk() const;  // this device's functions; never call through volk's global pointers
  VkPipelineLayout pipeline_layout() const;
  std::uint32_t max_groups() const;  // most workgroups one dispatch may have
  // Whether all device buffers so far lie in the memory window (memory_window.cpp), and then what kernels must be made
  // with to read through it. They may only read buffers that were made while this was true.
  bool windowed() const;
  SpecConstants window_constants() const;
  std::uint32_t window_begin() const;  // lower half of its address: Root::window
  std::uint64_t bytes_in_use() const;  // by Buffers, as the driver rounds them
  std::uint64_t peak_bytes() const;
  void set_memory_limit(std::uint64_t bytes);  // a Buffer that would go past it throws OutOfMemory; 0: no limit
  // Timing costs two timestamps a stage where the device has them; else each begin_stage() flushes. On by default
  // where there are timestamps.
  void set_stage_timing(bool on);
  std::vector<StageTime> stage_times() const;  // since reset_stage_times()
  std::uint64_t submissions() const;           // to the queue, since reset_stage_times()
  std::uint64_t host_waits() const;            // for them
  void reset_stage_times();
  void add_stage_time(std::string_view name, double seconds);  // host stages report here
  std::uint64_t validation_messages() const;  // counted when validation is on; each is printed to stderr

  // Convenience: a device buffer filled from host memory (through staging where memory is not shared).
  std::unique_ptr<Buffer> upload(std::span<const std::byte> data, std::string_view label);
  void write(Buffer& buffer, std::size_t offset, std::span<const std::byte> data);
  void read(const Buffer& buffer, std::size_t offset, std::span<std::byte> data);

  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace hw
