// SPDX-License-Identifier: Apache-2.0
// What tests of the scene's tables share: a scene with its tables on a device, small things to put in it, and a look
// into the records.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "scene/tables_impl.h"

namespace hw {

struct TablesInspector {
  explicit TablesInspector(const Tables& tables) : t(tables) {}
  const InstanceRecord& instance(std::size_t i) const { return t.instance_table_[i]; }
  const MeshRecord& mesh(Id id) const { return t.mesh_table_[t.meshes_.at(id).record]; }
  const MeshRecord& mesh_at(std::size_t i) const { return t.mesh_table_[i]; }
  const MaterialRecord& material(std::size_t i) const { return t.material_table_[i]; }
  const ImageRecord& image(std::size_t i) const { return t.image_table_[i]; }
  const LightRecord& light(std::size_t i) const { return t.light_table_[i]; }
  const AliasEntry& alias(std::size_t i) const { return t.alias_table_[i]; }
  std::uint32_t slot(std::size_t i) const { return t.slot_table_[i]; }
  std::uint32_t program_word(std::size_t i) const { return t.program_table_[i]; }
  std::size_t images() const { return t.image_table_.size(); }
  const float* positions(Id id) const { return t.meshes_.at(id).positions->as<float>(); }
  const Tables& t;
};

namespace table_rig {

inline Device& device() {
  static Device d("cpu");
  return d;
}

inline Matrix34 at(float x, float y = 0, float z = 0) { return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}; }

// A square of side 2 about the origin in z = 0.
inline MeshData quad(float z = 0) {
  MeshData mesh;
  mesh.name = "quad";
  mesh.positions = {-1, -1, z, 1, -1, z, 1, 1, z, -1, 1, z};
  mesh.tri_vertices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

inline InstanceData instance_of(Id mesh, Matrix34 matrix = at(0), std::vector<Id> materials = {}) {
  InstanceData data;
  data.name = "thing";
  data.mesh = mesh;
  data.object_to_world = matrix;
  data.materials = std::move(materials);
  return data;
}

inline MaterialData material(std::uint32_t flags, float emission = 0) {
  MaterialData data = default_material();
  data.flags = flags;
  data.emission = {emission, emission, emission};
  return data;
}

inline LightData lamp(std::uint32_t type, float x) {
  LightData data;
  data.name = "lamp";
  data.type = type;
  data.object_to_world = at(x);
  return data;
}

struct Rig {
  Scene scene;
  std::unique_ptr<Tracer> tracer = make_tracer(device(), "embree", 2);
  Tables tables{device(), scene, *tracer};
  TablesInspector see{tables};
  TableCounts update() {
    scene.commit();
    return tables.update();
  }
};

}  // namespace table_rig
}  // namespace hw
