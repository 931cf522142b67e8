// SPDX-License-Identifier: Apache-2.0
// The Tracer seam: fills a hit buffer from a ray buffer. Shading stages never trace; any integrator runs on any Tracer.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "shared/lights.h"
#include "shared/rays.h"

namespace hw {

// One mesh's geometry, in object space. The spans must stay valid and unchanged until the mesh is removed or replaced.
struct TraceMesh {
  std::span<const float> positions;        // 3 floats a vertex, metres
  std::span<const std::uint32_t> indices;  // 3 a triangle, into positions
  std::string name;                        // for error messages
  bool padded = false;                     // four bytes that may be read follow the last position
};

// One instance. Its place in the array is `Hit::instance`.
struct TraceInstance {
  float object_to_world[12];  // row-major 3x4, as VkTransformMatrixKHR and RTC_FORMAT_FLOAT3X4_ROW_MAJOR
  std::uint64_t mesh;         // the id given to set_mesh
  std::uint32_t mask;         // HW_MASK_* (8 bits)
  bool moves;                 // a hint: this object is known to move between frames
};

struct TracerStats {
  double build_seconds = 0;       // time spent in builds since construction
  std::uint64_t build_bytes = 0;  // memory the acceleration structures hold now
};

// Which rays: the queue's path ids select entries of the ray and hit arrays.
struct TraceArgs {
  Buffer* queue;           // QueueHeader then path ids
  Buffer* rays;            // Ray[]
  Buffer* hits;            // Hit[] for closest; uint[] for any (1 = occluded, 0 = free)
  std::uint32_t capacity;  // the largest count the queue can hold: bounds the dispatch
};

class Tracer {
 public:
  virtual ~Tracer() = default;
  virtual const char* name() const = 0;   // "ray_query", "ray_pipeline" or "embree"
  virtual bool runs_on_host() const = 0;  // a host Tracer splits the submission: flush() before, resume after

  // Geometry edits, before commit(). set_mesh() or commit() throws std::runtime_error naming the mesh when a build
  // fails. Instances with a singular matrix or a mesh without triangles are not hit.
  virtual void set_mesh(std::uint64_t id, const TraceMesh& mesh) = 0;
  virtual void remove_mesh(std::uint64_t id) = 0;
  virtual void set_instances(std::span<const TraceInstance> instances) = 0;
  virtual void set_lamps(std::span<const LampShape> lamps) = 0;  // intersected when Ray::mask has HW_MASK_LAMP
  virtual void commit() = 0;                                     // builds what changed

  // Records (device) or runs (host, after flushing `commands`) the trace.
  virtual void closest(Commands& commands, const TraceArgs& args) = 0;
  virtual void any(Commands& commands, const TraceArgs& args) = 0;

  virtual TracerStats stats() const = 0;

  // Whose geometry it holds (a Tables), and how that one takes it out again when another wants to use the Tracer.
  const void* owner = nullptr;
  std::function<void()> evict_owner;
};

// The kind that "auto" stands for: on a GPU ray_query, or ray_pipeline where only that is there (data-centre parts);
// else embree.
const char* best_tracer(const DeviceInfo& info);

// `kind`: "auto", "ray_query", "ray_pipeline" or "embree". `threads`: host threads, 0 = all. Throws DeviceError when
// the device can't run the kind asked for, saying what is missing.
std::unique_ptr<Tracer> make_tracer(Device& device, const std::string& kind, int threads);

}  // namespace hw
