// SPDX-License-Identifier: Apache-2.0
// The scene in Embree. Objects that stand still and have a mesh of their own are baked, in world space, into one scene;
// the rest are instances; lamps are user geometry. docs/decisions/0005-embree-two-level.md says why.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "trace/embree_api.h"
#include "trace/tracer.h"
#include "trace/worker_pool.h"

namespace hw {

class EmbreeScene {
 public:
  EmbreeScene(WorkerPool& pool, int threads);  // threads: Embree's build threads, 0 for all
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  void set_mesh(std::uint64_t id, const TraceMesh& mesh);
  void remove_mesh(std::uint64_t id);
  void set_instances(std::span<const TraceInstance> instances);
  void set_lamps(std::span<const LampShape> lamps);
  void commit();

  std::uint64_t bytes() const;
  double build_seconds() const { return seconds_; }

  // To be traced one after another; null when there is nothing in them.
  RTCScene baked() const { return baked_count_ ? baked_ : nullptr; }
  RTCScene instanced() const { return slots_.empty() ? nullptr : instanced_; }
  RTCScene lamps() const { return lamps_.empty() ? nullptr : lamp_scene_; }
  // The place in set_instances() of a hit's geomID in baked(), or of its instID in instanced().
  std::uint32_t baked_instance(std::uint32_t geometry) const { return baked_instances_[geometry]; }
  std::uint32_t slot_instance(std::uint32_t slot) const { return slot_instances_[slot]; }

 private:
  using Matrix = std::array<float, 12>;
  struct Mesh {
    TraceMesh source;
    std::uint64_t version = 0;          // of `source`
    std::uint32_t users = 0, user = 0;  // instances that show it, and the last of them
    bool moved = false;                 // its baked instance once moved: never baked again
    RTCScene scene = nullptr;           // for instances; null until one needs it
    std::uint64_t scene_version = 0;
    std::vector<float> positions;    // what `scene` reads, where the source lacks the padding Embree asks for
    RTCGeometry geometry = nullptr;  // in baked_
    std::uint32_t geometry_id = 0;
    std::uint64_t baked_version = 0;
    Matrix baked_matrix{};
    std::uint32_t baked_mask = 0;
    std::unique_ptr<float[]> world_positions;  // what `geometry` reads
  };
  struct Slot {  // one geometry of instanced_, its id is the place in slots_
    RTCGeometry geometry = nullptr;
    RTCScene scene = nullptr;
    Matrix matrix{};
    std::uint32_t mask = 0;
  };

  void count_users();
  void bake(Mesh& mesh, const TraceInstance& instance);
  void unbake(Mesh& mesh);
  void build_mesh_scene(Mesh& mesh) const;
  void build_mesh_scenes();
  void update_slots();
  void build_lamps();
  RTCGeometry triangles(const TraceMesh& source, const float* positions) const;
  void check(const std::string& what) const;
  Mesh& mesh_of(const TraceInstance& instance, std::size_t index);

  WorkerPool& pool_;
  RTCDevice device_ = nullptr;
  RTCScene baked_ = nullptr, instanced_ = nullptr, lamp_scene_ = nullptr;
  std::unordered_map<std::uint64_t, Mesh> meshes_;
  std::vector<TraceInstance> instances_;
  std::vector<LampShape> lamps_;
  std::vector<std::uint32_t> baked_instances_, slot_instances_;
  std::vector<Slot> slots_;
  std::size_t baked_count_ = 0;
  std::uint64_t versions_ = 0;
  bool changed_ = true, lamps_changed_ = false, baked_changed_ = false;
  double seconds_ = 0;
  std::atomic<std::int64_t> embree_bytes_{0};
};

}  // namespace hw
