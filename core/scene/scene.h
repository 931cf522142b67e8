// SPDX-License-Identifier: Apache-2.0
// Plain scene data under stable ids: what a caller says, checked at this boundary, with track of what changed.
// Every upsert either takes effect whole or throws SceneError naming the object and the reason; the scene stays as it
// was.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

#include "shared/rays.h"
#include "shared/tables.h"

namespace hw {

struct SceneError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
using Id = std::uint64_t;
using Matrix34 = std::array<float, 12>;  // row-major, object to world

std::uint32_t attribute_hash(const std::string& name);  // FNV-1a, never 0

struct AttributeData {
  std::string name;
  std::uint32_t domain = HW_DOMAIN_CORNER;
  std::uint32_t components = 2;
  std::vector<float> data;
};

// Asks for the tangents of a UV map, as one more attribute of 4 components at corners (scene/tangents.h).
struct TangentRequest {
  std::string name;
  std::size_t uv = 0;  // index of the map among the attributes
};

// Views of a mesh's arrays, which lie elsewhere.
struct MeshArrays {
  std::span<const float> positions, normals;
  std::span<const std::uint32_t> tri_vertices, tri_corners;
  std::span<const std::uint8_t> tri_slots;
  std::vector<std::span<const float>> attributes;
};

struct MeshData {
  std::string name;
  std::vector<float> positions;             // 3 V
  std::vector<std::uint32_t> tri_vertices;  // 3 T
  std::vector<std::uint32_t> tri_corners;   // 3 T or empty
  std::vector<float> normals;               // 3 C or empty (flat)
  std::vector<std::uint8_t> tri_slots;      // T or empty
  std::vector<AttributeData> attributes;
  std::vector<TangentRequest> tangents;  // made at the next commit
  int default_uv = -1;
  // Where there is a keeper, the vectors are empty and the arrays are these: nobody changes them while the keeper
  // lives.
  MeshArrays lent;
  std::shared_ptr<const void> keeper;
};

struct InstanceData {
  std::string name;
  Id mesh = 0;
  Matrix34 object_to_world{};
  std::vector<Id> materials;  // per slot; 0 = default material
  std::uint32_t visibility =
      HW_MASK_CAMERA | HW_MASK_DIFFUSE | HW_MASK_GLOSSY | HW_MASK_TRANSMISSION | HW_MASK_SHADOW_OPAQUE;
  std::uint32_t object_index = 0;
  std::uint32_t random_id = 0;
  std::uint32_t flags = 0;
  std::array<float, 3> color{1, 1, 1};
  float shadow_terminator_offset = 0.1f;
  bool moves = false;
};

struct LightData {
  std::string name;
  std::uint32_t type = HW_LIGHT_POINT;  // lamps only: point, spot, sun, area
  std::uint32_t flags =
      HW_LIGHT_CAST_SHADOW | HW_LIGHT_USE_MIS | HW_LIGHT_DIFFUSE | HW_LIGHT_GLOSSY | HW_LIGHT_TRANSMISSION;
  Matrix34 object_to_world{};
  std::array<float, 3> color{1, 1, 1};  // linear, times strength; the lamp's power is separate
  float power = 1;                      // Blender's `energy`: W for point, spot, area; W m^-2 for sun
  bool normalize = true;                // Blender's Normalize: power is divided by the area
  float radius = 0;                     // point, spot
  float angle = 0;                      // sun: full angle, rad
  float size_x = 1, size_y = 1;         // area: full size
  bool ellipse = false;
  float spread = 3.14159265f;   // area: full angle, rad
  float spot_size = 0.785398f;  // full cone angle, rad
  float spot_blend = 0.15f;
};

struct MaterialData {
  std::string name;
  std::vector<std::uint32_t> program;  // see shared/material_program.h
  std::vector<float> constants;        // 4 floats each
  std::vector<Id> images;              // what the program's image operands index
  std::uint32_t flags = 0;             // HW_MATERIAL_*
  std::array<float, 3> emission{0, 0, 0};
  std::uint32_t pass_index = 0;
};

struct ImageData {
  std::string name;
  std::uint32_t width = 0, height = 0;  // 0 x 0: missing
  std::uint32_t format = HW_TEXEL_RGBA8;
  std::uint32_t flags = 0;
  std::vector<std::uint8_t> texels;  // bottom row first
  // Where there is a keeper, `texels` is empty and they are these: nobody changes them while the keeper lives.
  std::span<const std::uint8_t> lent;
  std::shared_ptr<const void> keeper;
};

struct WorldData {
  std::string name;
  std::array<float, 3> color{0, 0, 0};
  Id material = 0;                     // a material whose program ends in a background; 0: constant colour
  std::uint32_t importance_width = 0;  // resolution of the importance map, 0 = automatic (as Cycles)
  bool sample = true;                  // next-event estimation towards the world
  std::uint32_t flags = HW_LIGHT_CAMERA | HW_LIGHT_DIFFUSE | HW_LIGHT_GLOSSY | HW_LIGHT_TRANSMISSION | HW_LIGHT_USE_MIS;
};

using CameraData = CameraRecord;  // already in picture-plane form; previous_* filled by the scene

// What commit() found changed since the last commit.
struct Changes {
  std::vector<Id> meshes_set, meshes_removed;
  bool instances = false, lights = false, materials = false, images = false, camera = false, world = false;
  bool transforms_only = false;  // instances changed only in their matrices
  bool any() const {
    return !meshes_set.empty() || !meshes_removed.empty() || instances || lights || materials || images || camera ||
           world;
  }
};

class Scene {
 public:
  void upsert_mesh(Id id, MeshData mesh);
  void upsert_instance(Id id, InstanceData instance);
  // Many instances of one mesh at once: `matrices` holds 12 floats each; ids are first_id, first_id + 1, ...
  void upsert_instances(Id first_id, const InstanceData& shared, const float* matrices, const std::uint32_t* random_ids,
                        std::size_t count);
  void upsert_light(Id id, LightData light);
  // Many lamps at once, alike but for their place: `matrices` holds 12 floats for each id.
  void upsert_lights(std::span<const Id> ids, const LightData& shared, const float* matrices);
  void upsert_material(Id id, MaterialData material);
  void upsert_image(Id id, ImageData image);
  void set_world(WorldData world);
  void set_camera(const CameraData& camera);
  // The keepers of lent arrays that are read no more. They end here and not beside the work, because the end of a
  // keeper may have to wait for others.
  std::vector<std::shared_ptr<const void>> take_done_keepers();
  // Copies the meshes' arrays that were lent and are still read, as no device has them: who lent them may free them.
  void keep_lent();
  void remove_mesh(Id id);  // throws while an instance uses it
  void remove_instance(Id id);
  void remove_instances(Id first_id, std::size_t count);
  void remove_light(Id id);
  void remove_lights(std::span<const Id> ids);
  void remove_material(Id id);
  void remove_image(Id id);
  bool has_mesh(Id id) const;
  // Ends a frame's edits: makes tangents, on `threads` (0: all); transforms and cameras that were not set again keep
  // their place, with previous = current.
  Changes commit(int threads = 0);
  void clear();

  struct Impl;
  const Impl& impl() const { return *impl_; }
  Impl& impl() { return *impl_; }  // for Tables, which borrows arrays
  Scene();
  ~Scene();

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace hw
