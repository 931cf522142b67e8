// SPDX-License-Identifier: Apache-2.0
// The scene in Embree: what is baked, what is instanced, and what a change costs.

#include "trace/embree_scene.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "trace/embree_lamps.h"
#include "trace/transform.h"

namespace hw {
namespace {

constexpr std::size_t kLargeMesh = 50'000;  // triangles from which one build fills all threads

// Positions with the four bytes after the last vertex that Embree's 16-byte loads read.
std::vector<float> padded(std::span<const float> positions) {
  std::vector<float> result(positions.size() + 4, 0.0f);
  std::copy(positions.begin(), positions.end(), result.begin());
  return result;
}

std::unique_ptr<float[]> transformed(std::span<const float> positions, const float* m) {
  std::unique_ptr<float[]> result = std::make_unique_for_overwrite<float[]>(positions.size() + 4);
  std::fill_n(result.get() + positions.size(), 4, 0.0f);
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    const float x = positions[i], y = positions[i + 1], z = positions[i + 2];
    for (int row = 0; row < 3; ++row)
      result[i + row] = m[4 * row] * x + m[4 * row + 1] * y + m[4 * row + 2] * z + m[4 * row + 3];
  }
  return result;
}

bool same(const std::array<float, 12>& a, const float* b) { return std::memcmp(a.data(), b, sizeof a) == 0; }

void assign(std::array<float, 12>& a, const float* b) { std::memcpy(a.data(), b, sizeof a); }

RTCScene new_scene(RTCDevice device, unsigned flags, RTCBuildQuality quality) {
  RTCScene scene = rtcNewScene(device);
  // Robust: no light leaks through the edges between triangles, as with ray query.
  rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(flags | RTC_SCENE_FLAG_ROBUST));
  rtcSetSceneBuildQuality(scene, quality);
  return scene;
}

}  // namespace

EmbreeScene::EmbreeScene(WorkerPool& pool, int threads) : pool_(pool) {
  // Embree bounds the process's TBB with `threads`, so it is only said when asked for.
  device_ = rtcNewDevice(threads > 0 ? ("threads=" + std::to_string(threads)).c_str() : nullptr);
  if (!device_) throw DeviceError("Embree could not start (error " + std::to_string(rtcGetDeviceError(nullptr)) + ").");
  if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_VERSION_MAJOR) != RTC_VERSION_MAJOR) {
    rtcReleaseDevice(device_);
    throw DeviceError("Another version of Embree is already loaded in this process; Headwater was built with Embree " +
                      std::to_string(RTC_VERSION_MAJOR) + ".");
  }
  if (!rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED)) {
    rtcReleaseDevice(device_);
    throw DeviceError(
        "This build of Embree has no ray masks (EMBREE_RAY_MASK), which Headwater needs for ray visibility.");
  }
  rtcSetDeviceMemoryMonitorFunction(
      device_,
      [](void* user, ssize_t bytes, bool) {
        static_cast<std::atomic<std::int64_t>*>(user)->fetch_add(bytes, std::memory_order_relaxed);
        return true;
      },
      &embree_bytes_);
  // Low scene quality with dynamic makes Embree keep a BVH for each geometry and join them, opened, under one top.
  baked_ = new_scene(device_, RTC_SCENE_FLAG_DYNAMIC, RTC_BUILD_QUALITY_LOW);
  instanced_ = new_scene(device_, RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_MEDIUM);
  lamp_scene_ = new_scene(device_, RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_MEDIUM);
}

EmbreeScene::~EmbreeScene() {
  for (Slot& slot : slots_) rtcReleaseGeometry(slot.geometry);
  for (auto& [id, mesh] : meshes_) {
    if (mesh.geometry) rtcReleaseGeometry(mesh.geometry);
    if (mesh.scene) rtcReleaseScene(mesh.scene);
  }
  rtcReleaseScene(lamp_scene_);
  rtcReleaseScene(instanced_);
  rtcReleaseScene(baked_);
  rtcReleaseDevice(device_);
}

std::uint64_t EmbreeScene::bytes() const {
  std::uint64_t bytes = std::max<std::int64_t>(0, embree_bytes_.load());
  for (const auto& [id, mesh] : meshes_)
    bytes += 4 * (mesh.positions.size() + (mesh.world_positions ? mesh.source.positions.size() + 4 : 0));
  return bytes + slots_.size() * sizeof(Slot);
}

void EmbreeScene::check(const std::string& what) const {
  const RTCError error = rtcGetDeviceError(device_);
  if (error == RTC_ERROR_NONE) return;
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw OutOfMemory("Out of memory while building " + what + " for ray tracing.");
  throw std::runtime_error("Building " + what + " for ray tracing failed (Embree error " + std::to_string(error) +
                           ").");
}

void EmbreeScene::set_mesh(std::uint64_t id, const TraceMesh& source) {
  const std::size_t vertices = source.positions.size() / 3;
  std::uint32_t largest = 0;
  for (const std::uint32_t index : source.indices) largest = std::max(largest, index);
  if (!source.indices.empty() && largest >= vertices)
    throw std::runtime_error("Mesh \"" + source.name + "\" has a triangle of vertex " + std::to_string(largest) +
                             ", but only " + std::to_string(vertices) + " vertices.");
  Mesh& mesh = meshes_[id];
  mesh.source = source;
  mesh.version = ++versions_;
  changed_ = true;
}

void EmbreeScene::remove_mesh(std::uint64_t id) {
  const auto found = meshes_.find(id);
  if (found == meshes_.end()) return;
  unbake(found->second);
  if (found->second.scene)
    rtcReleaseScene(found->second.scene);  // instances still attached keep it alive until commit()
  meshes_.erase(found);
  changed_ = true;
}

void EmbreeScene::set_instances(std::span<const TraceInstance> instances) {
  instances_.assign(instances.begin(), instances.end());
  changed_ = true;
}

void EmbreeScene::set_lamps(std::span<const LampShape> lamps) {
  lamps_.assign(lamps.begin(), lamps.end());
  lamps_changed_ = true;
}

EmbreeScene::Mesh& EmbreeScene::mesh_of(const TraceInstance& instance, std::size_t index) {
  const auto found = meshes_.find(instance.mesh);
  if (found == meshes_.end())
    throw std::runtime_error("Instance " + std::to_string(index) + " is of a mesh that does not exist.");
  return found->second;
}

void EmbreeScene::count_users() {
  for (auto& [id, mesh] : meshes_) mesh.users = 0;
  Mesh* last = nullptr;
  std::uint64_t last_id = 0;
  for (std::uint32_t i = 0; i < instances_.size(); ++i) {
    if (!last || instances_[i].mesh != last_id) {
      last = &mesh_of(instances_[i], i);
      last_id = instances_[i].mesh;
    }
    ++last->users;
    last->user = i;
  }
}

RTCGeometry EmbreeScene::triangles(const TraceMesh& source, const float* positions) const {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, 12,
                             source.positions.size() / 3);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, source.indices.data(), 0, 12,
                             source.indices.size() / 3);
  return geometry;
}

void EmbreeScene::bake(Mesh& mesh, const TraceInstance& instance) {
  const bool new_mesh = !mesh.geometry || mesh.baked_version != mesh.version;
  if (new_mesh) {
    unbake(mesh);
    mesh.world_positions = transformed(mesh.source.positions, instance.object_to_world);
    mesh.geometry = triangles(mesh.source, mesh.world_positions.get());
    mesh.geometry_id = rtcAttachGeometry(baked_, mesh.geometry);
    mesh.baked_version = mesh.version;
    assign(mesh.baked_matrix, instance.object_to_world);
    ++baked_count_;
  }
  if (new_mesh || mesh.baked_mask != instance.mask) {
    mesh.baked_mask = instance.mask;
    rtcSetGeometryMask(mesh.geometry, instance.mask);
    rtcCommitGeometry(mesh.geometry);
    baked_changed_ = true;
  }
  if (baked_instances_.size() <= mesh.geometry_id) baked_instances_.resize(mesh.geometry_id + 1, HW_NONE);
  baked_instances_[mesh.geometry_id] = mesh.user;
}

void EmbreeScene::unbake(Mesh& mesh) {
  if (!mesh.geometry) return;
  rtcDetachGeometry(baked_, mesh.geometry_id);
  rtcReleaseGeometry(mesh.geometry);
  mesh.geometry = nullptr;
  mesh.world_positions.reset();
  --baked_count_;
  baked_changed_ = true;
}

void EmbreeScene::build_mesh_scene(Mesh& mesh) const {
  if (mesh.scene) rtcReleaseScene(mesh.scene);
  mesh.positions = mesh.source.padded ? std::vector<float>() : padded(mesh.source.positions);
  mesh.scene = new_scene(device_, RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_MEDIUM);
  RTCGeometry geometry =
      triangles(mesh.source, mesh.source.padded ? mesh.source.positions.data() : mesh.positions.data());
  rtcSetGeometryMask(geometry, ~0u);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(mesh.scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(mesh.scene);
  mesh.scene_version = mesh.version;
  check("mesh \"" + mesh.source.name + "\"");
}

void EmbreeScene::build_mesh_scenes() {
  std::vector<Mesh*> small, large;
  for (auto& [id, mesh] : meshes_) {
    const bool needed = mesh.users > 0 && !mesh.geometry && !mesh.source.indices.empty();
    if (!needed && mesh.scene) {
      rtcReleaseScene(mesh.scene);
      mesh.scene = nullptr;
      mesh.positions = {};
    }
    if (needed && (!mesh.scene || mesh.scene_version != mesh.version))
      (mesh.source.indices.size() / 3 < kLargeMesh ? small : large).push_back(&mesh);
  }
  for (Mesh* mesh : large) build_mesh_scene(*mesh);
  // Small builds don't fill the threads one by one: run them side by side.
  std::mutex mutex;
  std::exception_ptr failure;
  pool_.run(static_cast<std::uint32_t>(small.size()), 1, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i < last; ++i) try {
        build_mesh_scene(*small[i]);
      } catch (...) {
        std::lock_guard lock(mutex);
        failure = std::current_exception();
      }
  });
  if (failure) std::rethrow_exception(failure);
}

// Slot k shows the k-th instance that is neither baked nor invisible to rays.
void EmbreeScene::update_slots() {
  std::size_t used = 0;
  bool dirty = false;
  slot_instances_.clear();
  for (std::uint32_t i = 0; i < instances_.size(); ++i) {
    const TraceInstance& instance = instances_[i];
    const Mesh& mesh = mesh_of(instance, i);
    if (!mesh.scene || !invertible(instance.object_to_world)) continue;
    if (used == slots_.size()) {
      Slot slot;
      slot.geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcAttachGeometryByID(instanced_, slot.geometry, static_cast<unsigned>(used));
      slots_.push_back(slot);
    }
    Slot& slot = slots_[used++];
    slot_instances_.push_back(i);
    const bool other_scene =
        slot.scene != mesh.scene;  // a rebuilt one is new: the slot keeps the old one alive until here
    if (!other_scene && slot.mask == instance.mask && same(slot.matrix, instance.object_to_world)) continue;
    if (other_scene) rtcSetGeometryInstancedScene(slot.geometry, mesh.scene);
    slot.scene = mesh.scene;
    slot.mask = instance.mask;
    assign(slot.matrix, instance.object_to_world);
    rtcSetGeometryTransform(slot.geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, slot.matrix.data());
    rtcSetGeometryMask(slot.geometry, slot.mask);
    rtcCommitGeometry(slot.geometry);
    dirty = true;
  }
  dirty = dirty || used < slots_.size();
  for (std::size_t k = used; k < slots_.size(); ++k) {
    rtcDetachGeometry(instanced_, static_cast<unsigned>(k));
    rtcReleaseGeometry(slots_[k].geometry);
  }
  slots_.resize(used);
  if (dirty) rtcCommitScene(instanced_);
}

void EmbreeScene::build_lamps() {
  rtcReleaseScene(lamp_scene_);
  lamp_scene_ = new_scene(device_, RTC_SCENE_FLAG_NONE, RTC_BUILD_QUALITY_MEDIUM);
  if (lamps_.empty()) return;
  attach_lamps(device_, lamp_scene_, lamps_);
  rtcCommitScene(lamp_scene_);
  check("the lamps");
}

void EmbreeScene::commit() {
  if (!changed_ && !lamps_changed_) return;
  const auto start = std::chrono::steady_clock::now();
  if (changed_) {
    count_users();
    for (auto& [id, mesh] : meshes_) {
      const TraceInstance* instance = mesh.users == 1 ? &instances_[mesh.user] : nullptr;
      if (instance && mesh.geometry && !same(mesh.baked_matrix, instance->object_to_world)) mesh.moved = true;
      if (instance && !instance->moves && !mesh.moved && !mesh.source.indices.empty() &&
          invertible(instance->object_to_world))
        bake(mesh, *instance);
      else
        unbake(mesh);
    }
    build_mesh_scenes();
    update_slots();
    if (baked_changed_) rtcCommitScene(baked_);
    check("the scene");
    changed_ = baked_changed_ = false;
  }
  if (lamps_changed_) {
    build_lamps();
    lamps_changed_ = false;
  }
  seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace hw
