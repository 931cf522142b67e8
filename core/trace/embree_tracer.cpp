// SPDX-License-Identifier: Apache-2.0
// Tracer on the host through Embree: reads rays and writes hits in the mapped buffers, in chunks on all threads.

#include "trace/embree_tracer.h"

#include <algorithm>
#include <chrono>

#include "trace/embree_scene.h"

namespace hw {
namespace {

constexpr std::uint32_t kChunk = 256;

void load(const Ray& ray, RTCRay& out) {
  if (!ray_is_traceable(ray)) [[unlikely]] {
    out = {};  // mask 0
    out.dir_z = 1;
    return;
  }
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

// A buffer as the host sees it: in place where it is mapped, else a copy that can be put back.
class HostView {
 public:
  HostView(Device& device, Buffer& buffer) : device_(device), buffer_(buffer), data_(buffer.mapped()) {
    if (data_) return;
    copy_.resize(buffer.bytes());
    device.read(buffer, 0, copy_);
    data_ = copy_.data();
  }
  template <class T>
  T* as() const {
    return static_cast<T*>(data_);
  }
  void put_back() {
    if (!copy_.empty()) device_.write(buffer_, 0, copy_);
  }

 private:
  Device& device_;
  Buffer& buffer_;
  void* data_;
  std::vector<std::byte> copy_;
};

class EmbreeTracer final : public Tracer {
 public:
  EmbreeTracer(Device& device, int threads) : device_(device), pool_(threads), scene_(pool_, threads) {}

  const char* name() const override { return "embree"; }
  bool runs_on_host() const override { return true; }
  void set_mesh(std::uint64_t id, const TraceMesh& mesh) override { scene_.set_mesh(id, mesh); }
  void remove_mesh(std::uint64_t id) override { scene_.remove_mesh(id); }
  void set_instances(std::span<const TraceInstance> instances) override { scene_.set_instances(instances); }
  void set_lamps(std::span<const LampShape> lamps) override { scene_.set_lamps(lamps); }
  void commit() override { scene_.commit(); }
  TracerStats stats() const override { return {scene_.build_seconds(), scene_.bytes()}; }

  void closest(Commands& commands, const TraceArgs& args) override {
    run<Hit>(commands, args, "trace_closest",
             [this](const Ray& ray, Hit& hit, EmbreeQuery& query) { closest1(ray, hit, query); });
  }

  void any(Commands& commands, const TraceArgs& args) override {
    run<std::uint32_t>(commands, args, "trace_any",
                       [this](const Ray& ray, std::uint32_t& hit, EmbreeQuery& query) { hit = any1(ray, query); });
  }

 private:
  template <class Result, class One>
  void run(Commands& commands, const TraceArgs& args, const char* stage, const One& one) {
    commands.flush();
    const auto start = std::chrono::steady_clock::now();
    const HostView queue(device_, *args.queue);
    const auto* header = queue.as<QueueHeader>();
    const auto* ids = reinterpret_cast<const std::uint32_t*>(header + 1);
    if (const std::uint32_t count = std::min(header->count, args.capacity)) {
      const HostView ray_view(device_, *args.rays);
      HostView hit_view(device_, *args.hits);
      const Ray* rays = ray_view.as<Ray>();
      Result* hits = hit_view.as<Result>();
      pool_.run(count, kChunk, [&](std::uint32_t first, std::uint32_t last) {
        EmbreeQuery query(false);
        for (std::uint32_t i = first; i < last; ++i) one(rays[ids[i]], hits[ids[i]], query);
      });
      hit_view.put_back();
    }
    device_.add_stage_time(stage, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }

  // One ray at a time, not in packets: a packet's neighbours would decide which of two triangles that share an edge is
  // hit, and the same path would not give the same bits in another tile.
  void closest1(const Ray& ray, Hit& hit, EmbreeQuery& query) const {
    if (ray.flags & HW_RAY_SURFACES_DARK) return lamp1(ray, hit, query);
    RTCRayHit rayhit;
    load(ray, rayhit.ray);
    rayhit.hit.geomID = rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rayhit.hit.u = rayhit.hit.v = 0;
    if (RTCScene scene = scene_.baked()) query.intersect1(scene, &rayhit);
    if (RTCScene scene = scene_.instanced()) query.intersect1(scene, &rayhit);
    hit.u = rayhit.hit.u;
    hit.v = rayhit.hit.v;
    hit.primitive = rayhit.hit.primID;
    if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID)
      hit.instance = hit.primitive = HW_NONE;
    else if (rayhit.hit.instID[0] == RTC_INVALID_GEOMETRY_ID)
      hit.instance = scene_.baked_instance(rayhit.hit.geomID);
    else
      hit.instance = scene_.slot_instance(rayhit.hit.instID[0]);
    if (RTCScene scene = ray.mask & HW_MASK_LAMP ? scene_.lamps() : nullptr) {
      rayhit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      query.intersect1(scene, &rayhit);
      if (rayhit.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
        hit.instance = HW_LAMP_INSTANCE;
        hit.primitive = rayhit.hit.primID;
        hit.u = hit.v = 0;
      }
    }
    hit.t = rayhit.ray.tfar;
  }

  // The nearest lamp, or nothing, that no surface hides: few rays meet a lamp, and those that do need no nearest
  // surface.
  void lamp1(const Ray& ray, Hit& hit, EmbreeQuery& query) const {
    hit = {};
    hit.instance = hit.primitive = HW_NONE;
    RTCRayHit rayhit;
    load(ray, rayhit.ray);
    if (RTCScene scene = ray.mask & HW_MASK_LAMP ? scene_.lamps() : nullptr) {
      rayhit.hit.geomID = rayhit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      query.intersect1(scene, &rayhit);
      if (rayhit.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
        hit.instance = HW_LAMP_INSTANCE;
        hit.primitive = rayhit.hit.primID;
      }
    }
    hit.t = rayhit.ray.tfar;
    Ray up_to = ray;
    up_to.tmax = hit.t;
    up_to.mask &= ~HW_MASK_LAMP;
    const bool nothing = hit.instance == HW_NONE && (ray.flags & HW_RAY_MISS_DARK);
    if (nothing || any1(up_to, query)) hit.instance = HW_BLOCKED_INSTANCE;
  }

  bool any1(const Ray& ray, EmbreeQuery& query) const {
    RTCRay embree;
    load(ray, embree);
    for (RTCScene scene : {scene_.baked(), scene_.instanced(), ray.mask & HW_MASK_LAMP ? scene_.lamps() : nullptr}) {
      if (!scene) continue;
      query.occluded1(scene, &embree);
      if (embree.tfar < 0) return true;
    }
    return false;
  }

  Device& device_;
  WorkerPool pool_;
  EmbreeScene scene_;
};

}  // namespace

std::unique_ptr<Tracer> make_embree_tracer(Device& device, int threads) {
  return std::make_unique<EmbreeTracer>(device, threads);
}

}  // namespace hw
