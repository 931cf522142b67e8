// SPDX-License-Identifier: Apache-2.0
// The scene's own state, shared by scene.cpp and tables.cpp only.
//
// Every entry carries the revision at which it last changed; a reader (Tables) keeps the revision it has seen, so that
// any number of readers can follow one scene. Maps are ordered, so that table indices, and with them the image's bits,
// do not depend on hashing.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "scene/scene.h"
#include "scene/validate.h"

namespace hw {

// Views of a mesh's own vectors.
MeshArrays mesh_views(const MeshData& data);

struct MeshEntry {
  MeshData data;      // vectors are empty while `lender` holds the arrays
  MeshArrays arrays;  // of the vectors of `data`, of what was lent, or of device memory after a reader took them over
  MeshSummary summary;
  const void* lender = nullptr;
  std::uint64_t revision = 0;
  std::uint64_t set_frame = 0;  // commit count when it was set
  std::size_t users = 0;        // instances
};

// Instances first_id, first_id + 1, ... of one mesh that share all but matrix and random number.
struct InstanceGroup {
  InstanceData shared;  // its object_to_world is not used
  std::vector<Matrix34> matrices;
  std::vector<Matrix34> previous;         // last frame's; empty: the same as `matrices`
  std::vector<std::uint32_t> random_ids;  // empty: shared.random_id for all
  std::uint64_t revision = 0;             // of anything in the group
  std::uint64_t placed_revision = 0;      // of `matrices`
  std::uint64_t shared_revision = 0;      // of all else: `shared`, `random_ids`
  std::uint64_t moved_frame = 0;          // commit count when `previous` was filled
  std::uint64_t created_frame = 0;        // commit count when it came: it has no last place in that frame
};

struct LightEntry {
  LightData data;
  std::uint64_t revision = 0;
};

struct MaterialEntry {
  MaterialData data;
  std::uint64_t revision = 0;
  std::size_t users = 0;  // instance groups (once each slot) and the world
};

struct ImageEntry {
  ImageData data;  // texels are empty while `lender` holds them
  std::span<const std::uint8_t> texels;
  const void* lender = nullptr;
  std::uint64_t revision = 0;
  std::size_t users = 0;  // materials, once each mention
};

struct Scene::Impl {
  std::map<Id, MeshEntry> meshes;
  std::map<Id, InstanceGroup> groups;  // by first id; ranges never overlap
  std::map<Id, LightEntry> lights;
  std::map<Id, MaterialEntry> materials;
  std::map<Id, ImageEntry> images;
  std::vector<std::shared_ptr<const void>> done_keepers;
  WorldData world;
  CameraData camera{};
  bool has_camera = false;
  std::size_t instance_count = 0;

  std::uint64_t revision = 2;         // the next change's revision; those below start at the one before any change
  std::uint64_t frame = 0;            // commits so far
  std::uint64_t layout_revision = 1;  // instances came, went, or changed mesh or slots
  std::uint64_t lights_revision = 1, materials_revision = 1, images_revision = 1, world_revision = 1,
                camera_revision = 1;
  std::uint64_t camera_frame = 0;  // commit count when the camera was last set

  Changes pending;
  bool instances_moved = false, instances_other = false;

  void make_tangents(int threads);  // at commit: those that meshes ask for (mesh_tangents.cpp)

  // Instance groups (instances.cpp).
  void set_instances(Id first, const InstanceData& shared, const float* matrices, const std::uint32_t* random_ids,
                     std::size_t count);
  void remove_instances(Id first, std::size_t count);
  const InstanceGroup* find_group(Id id, Id* first = nullptr) const;
  void settle_transforms();  // at commit: groups not moved in this frame stand still

  void use_group(const InstanceGroup& group, std::ptrdiff_t sign);
  void use_materials(const std::vector<Id>& ids, std::ptrdiff_t sign);
  void touch_layout();

 private:
  InstanceGroup slice(const InstanceGroup& group, std::size_t begin, std::size_t end) const;
  std::map<Id, InstanceGroup>::iterator split_at(Id id);
};

}  // namespace hw
