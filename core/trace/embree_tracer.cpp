// SPDX-License-Identifier: Apache-2.0
// Tracer on the host through Embree: a scene per mesh, instances and lamps in a top scene.

#include "trace/embree_tracer.h"

#include <chrono>
#include <stdexcept>
#include <unordered_map>

#include "lib/lamp_intersect.h"
#include "trace/embree_api.h"
#include "trace/worker_pool.h"

namespace hw {
namespace {

constexpr std::uint32_t kChunk = 256;

struct Mesh {
  RTCScene scene = nullptr;
  std::string name;
};

void lamp_bounds(const RTCBoundsFunctionArguments* args) {
  const LampShape& lamp = static_cast<const LampShape*>(args->geometryUserPtr)[args->primID];
  const vec3 half = lamp_half_extent(lamp);
  if (lamp.shape == HW_LAMP_NOTHING) {
    args->bounds_o->lower_x = args->bounds_o->lower_y = args->bounds_o->lower_z = HW_INFINITY;
    args->bounds_o->upper_x = args->bounds_o->upper_y = args->bounds_o->upper_z = -HW_INFINITY;
    return;
  }
  args->bounds_o->lower_x = lamp.center.x - half.x;
  args->bounds_o->lower_y = lamp.center.y - half.y;
  args->bounds_o->lower_z = lamp.center.z - half.z;
  args->bounds_o->upper_x = lamp.center.x + half.x;
  args->bounds_o->upper_y = lamp.center.y + half.y;
  args->bounds_o->upper_z = lamp.center.z + half.z;
}

bool hit_lamp(const void* user, unsigned primitive, const RTCRay& ray, float& t) {
  if (!(ray.mask & HW_MASK_LAMP)) return false;
  const LampShape& lamp = static_cast<const LampShape*>(user)[primitive];
  return lamp_intersect(lamp, vec3(ray.org_x, ray.org_y, ray.org_z), vec3(ray.dir_x, ray.dir_y, ray.dir_z), ray.tnear, ray.tfar, t);
}

void lamp_closest(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto& rayhit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
  float t;
  if (!hit_lamp(args->geometryUserPtr, args->primID, rayhit.ray, t)) return;
  rayhit.ray.tfar = t;
  rayhit.hit.u = rayhit.hit.v = 0;
  rayhit.hit.geomID = args->geomID;
  rayhit.hit.primID = args->primID;
  rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

void lamp_any(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto& ray = *reinterpret_cast<RTCRay*>(args->ray);
  float t;
  if (hit_lamp(args->geometryUserPtr, args->primID, ray, t)) ray.tfar = -HW_INFINITY;
}

class EmbreeTracer final : public Tracer {
 public:
  EmbreeTracer(Device& device, int threads) : device_(device), pool_(threads) {
    const std::string config = "threads=" + std::to_string(pool_.threads());
    embree_ = rtcNewDevice(config.c_str());
    if (!embree_) throw DeviceError("Embree could not start (error " + std::to_string(rtcGetDeviceError(nullptr)) + ").");
    rtcSetDeviceMemoryMonitorFunction(
        embree_,
        [](void* user, ssize_t bytes, bool) {
          static_cast<EmbreeTracer*>(user)->bytes_.fetch_add(bytes);
          return true;
        },
        this);
    top_ = rtcNewScene(embree_);
  }

  ~EmbreeTracer() override {
    rtcReleaseScene(top_);
    for (auto& [id, mesh] : meshes_) rtcReleaseScene(mesh.scene);
    rtcReleaseDevice(embree_);
  }

  const char* name() const override { return "embree"; }
  bool runs_on_host() const override { return true; }

  void set_mesh(std::uint64_t id, const TraceMesh& mesh) override {
    remove_mesh(id);
    const auto start = std::chrono::steady_clock::now();
    RTCScene scene = rtcNewScene(embree_);
    RTCGeometry geometry = rtcNewGeometry(embree_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0, 12,
                               mesh.positions.size() / 3);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.indices.data(), 0, 12,
                               mesh.indices.size() / 3);
    rtcSetGeometryMask(geometry, ~0u);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    meshes_[id] = {scene, mesh.name};
    check("building mesh \"" + mesh.name + "\"");
    changed_ = true;
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  void remove_mesh(std::uint64_t id) override {
    const auto found = meshes_.find(id);
    if (found == meshes_.end()) return;
    rtcReleaseScene(found->second.scene);
    meshes_.erase(found);
    changed_ = true;
  }

  void set_instances(std::span<const TraceInstance> instances) override {
    instances_.assign(instances.begin(), instances.end());
    changed_ = true;
  }

  void set_lamps(std::span<const LampShape> lamps) override {
    lamps_.assign(lamps.begin(), lamps.end());
    changed_ = true;
  }

  void commit() override {
    if (!changed_) return;
    const auto start = std::chrono::steady_clock::now();
    rtcReleaseScene(top_);
    top_ = rtcNewScene(embree_);
    for (std::uint32_t i = 0; i < instances_.size(); ++i) {
      const auto mesh = meshes_.find(instances_[i].mesh);
      if (mesh == meshes_.end()) throw std::runtime_error("Instance " + std::to_string(i) + " is of a mesh that does not exist.");
      RTCGeometry geometry = rtcNewGeometry(embree_, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(geometry, mesh->second.scene);
      rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, instances_[i].object_to_world);
      rtcSetGeometryMask(geometry, instances_[i].mask);
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(top_, geometry, i);
      rtcReleaseGeometry(geometry);
    }
    if (!lamps_.empty()) {
      RTCGeometry geometry = rtcNewGeometry(embree_, RTC_GEOMETRY_TYPE_USER);
      rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(lamps_.size()));
      rtcSetGeometryUserData(geometry, lamps_.data());
      rtcSetGeometryBoundsFunction(geometry, [](const RTCBoundsFunctionArguments* args) { lamp_bounds(args); }, nullptr);
      rtcSetGeometryIntersectFunction(geometry, lamp_closest);
      rtcSetGeometryOccludedFunction(geometry, lamp_any);
      rtcSetGeometryMask(geometry, HW_MASK_LAMP);
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(top_, geometry, static_cast<unsigned>(instances_.size()));
      rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(top_);
    check("building the scene");
    changed_ = false;
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  void closest(Commands& commands, const TraceArgs& args) override {
    const std::uint32_t* ids = begin(commands, args);
    const auto start = std::chrono::steady_clock::now();
    const Ray* rays = args.rays->as<Ray>();
    Hit* hits = args.hits->as<Hit>();
    const std::uint32_t lamp_geometry = static_cast<std::uint32_t>(instances_.size());
    pool_.run(count_, kChunk, [&](std::uint32_t first, std::uint32_t last) {
      EmbreeQuery query(false);
      for (std::uint32_t i = first; i < last; ++i) {
        RTCRayHit rayhit;
        load(rays[ids[i]], rayhit.ray);
        rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        query.intersect1(top_, &rayhit);
        Hit& hit = hits[ids[i]];
        hit.t = rayhit.ray.tfar;
        if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
          hit.instance = hit.primitive = HW_NONE;
          continue;
        }
        hit.u = rayhit.hit.u;
        hit.v = rayhit.hit.v;
        hit.primitive = rayhit.hit.primID;
        hit.instance = rayhit.hit.instID[0] == RTC_INVALID_GEOMETRY_ID && rayhit.hit.geomID == lamp_geometry
                           ? HW_LAMP_INSTANCE
                           : rayhit.hit.instID[0];
      }
    });
    device_.add_stage_time("trace_closest", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }

  void any(Commands& commands, const TraceArgs& args) override {
    const std::uint32_t* ids = begin(commands, args);
    const auto start = std::chrono::steady_clock::now();
    const Ray* rays = args.rays->as<Ray>();
    std::uint32_t* hits = args.hits->as<std::uint32_t>();
    pool_.run(count_, kChunk, [&](std::uint32_t first, std::uint32_t last) {
      EmbreeQuery query(false);
      for (std::uint32_t i = first; i < last; ++i) {
        RTCRay ray;
        load(rays[ids[i]], ray);
        query.occluded1(top_, &ray);
        hits[ids[i]] = ray.tfar < 0;
      }
    });
    device_.add_stage_time("trace_any", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }

  TracerStats stats() const override { return {seconds_, static_cast<std::uint64_t>(std::max<std::int64_t>(0, bytes_))}; }

 private:
  static void load(const Ray& ray, RTCRay& out) {
    out.org_x = ray.origin.x;
    out.org_y = ray.origin.y;
    out.org_z = ray.origin.z;
    out.tnear = ray.tmin;
    out.dir_x = ray.direction.x;
    out.dir_y = ray.direction.y;
    out.dir_z = ray.direction.z;
    out.time = 0;
    out.tfar = ray.tmax;
    out.mask = ray.mask;
    out.id = 0;
    out.flags = 0;
  }

  const std::uint32_t* begin(Commands& commands, const TraceArgs& args) {
    commands.flush();
    const auto* header = args.queue->as<QueueHeader>();
    count_ = std::min(header->count, args.capacity);
    return reinterpret_cast<const std::uint32_t*>(header + 1);
  }

  void check(const std::string& what) {
    const RTCError error = rtcGetDeviceError(embree_);
    if (error == RTC_ERROR_NONE) return;
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw OutOfMemory("Out of memory " + what + ".");
    throw std::runtime_error("Embree failed " + what + " (error " + std::to_string(error) + ").");
  }

  Device& device_;
  WorkerPool pool_;
  RTCDevice embree_ = nullptr;
  RTCScene top_ = nullptr;
  std::unordered_map<std::uint64_t, Mesh> meshes_;
  std::vector<TraceInstance> instances_;
  std::vector<LampShape> lamps_;
  std::atomic<std::int64_t> bytes_{0};
  std::uint32_t count_ = 0;
  bool changed_ = true;
  double seconds_ = 0;
};

}  // namespace

std::unique_ptr<Tracer> make_embree_tracer(Device& device, int threads) { return std::make_unique<EmbreeTracer>(device, threads); }

}  // namespace hw
