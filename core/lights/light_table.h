// SPDX-License-Identifier: Apache-2.0
// All lights of a scene as one table: lamps (suns last), the world, emissive triangles; and the odds of choosing each.
// Units and conventions are those of Cycles 5.0 (Blender's lamp settings give the same radiance).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "shared/lights.h"
#include "shared/tables.h"

namespace hw {

enum class LightSelection {
  kUniform,  // every light alike
  kPower,    // by an estimate of the flux that reaches the scene
};

// An instance whose mesh has at least one emissive slot. Pointers must live during the call.
struct EmissiveInstance {
  std::string name;
  std::uint32_t instance = 0;  // index in the instance table
  Matrix34 object_to_world{};
  std::span<const float> positions;               // 3 V, object space
  std::span<const std::uint32_t> tri_vertices;    // 3 T
  std::span<const std::uint8_t> tri_slots;        // T, or empty: slot 0
  std::span<const std::uint32_t> slot_materials;  // material index of each slot; beyond its end: the last slot's
  std::uint32_t flags = 0;                        // HW_LIGHT_CAMERA .. HW_LIGHT_TRANSMISSION: who sees the object
  // Of triangles whose emission a program gives, measured: the mean radiance of each; where its map begins among those
  // at maps_at of Root::emission_maps, HW_NONE for none. T, or empty: not measured; without maps.
  std::span<const float> radiance;
  std::span<const std::uint32_t> maps;
  std::uint32_t maps_at = 0;
};

struct WorldLight {
  bool emits = false;                           // take it as a light (next-event estimation towards the world)
  std::array<float, 3> mean_radiance{0, 0, 0};  // over the sphere of directions
  std::uint32_t material = HW_NONE;
  std::uint32_t flags = 0;  // HW_LIGHT_*
};

struct LightTableInput {
  std::span<const LightData> lamps;
  std::span<const EmissiveInstance> instances;
  std::span<const MaterialRecord> materials;  // emission and flags are read
  WorldLight world;
  float scene_radius = 1;  // of a sphere about everything [m]; scales suns and the world
  LightSelection selection = LightSelection::kPower;
};

struct LightWarning {
  std::string name;  // of the lamp or instance
  std::string reason;
};

// Where the records of a table go: returns room for so many, which stays where it is while the table is used. They are
// most of a table, and wanted once only: on the device, where the host can see it.
using LightRoom = std::function<LightRecord*(std::size_t)>;

struct LightTable {
  LightTable() = default;
  LightTable(LightTable&&) = default;
  LightTable& operator=(LightTable&&) = default;

  std::span<LightRecord> lights;               // lamps, suns last among them; the world; triangles
  std::vector<LightRecord> own;                // holds them where no room was given
  std::vector<LampShape> shapes;               // one for each lamp
  std::vector<float> weights;                  // one for each light: flux estimate [W]; 0: never chosen
  std::vector<AliasEntry> alias;               // one for each light
  std::vector<std::uint32_t> lamp_index;       // where input lamp i went
  std::vector<std::uint32_t> instance_offset;  // first light of input instance i; its triangle t is at offset + t
  std::vector<std::uint32_t> instance_kinds;   // HW_KIND_* of the triangles of input instance i
  std::uint32_t lamp_count = 0;
  std::uint32_t sun_offset = 0, sun_count = 0;
  std::uint32_t world_light = HW_NONE;
  std::uint32_t kinds = 0;             // HW_KIND_* of all
  float total_weight = 0;              // 0: nothing to sample
  std::vector<LightWarning> warnings;  // lights left out (weight 0), with the reason
};

// Builds the table in O(lights), on several threads for large meshes. Lights that cannot emit (power not finite or not
// positive, matrix not finite or flat, triangles without area) keep their place with weight 0 and emission 0.
// Throws SceneError naming the instance when an index points outside its mesh, or there are 2^32 - 1 lights or more.
LightTable build_light_table(const LightTableInput& input, const LightRoom& room = {});

// The same scene with other lamp settings or matrices: rewrites lamps, the world and the instances listed in `moved`
// (indices into input.instances), and the odds where weights changed. Counts and order of everything must be as when
// the table was built; throws SceneError otherwise. Call build_light_table instead when the selection changed.
void update_light_table(LightTable& table, const LightTableInput& input, std::span<const std::uint32_t> moved);

// What a material slot of an instance emits. Throws SceneError naming the instance for a material that does not exist.
struct SlotEmission {
  bool emits = false;
  vec3 emission{0};     // constant emission, radiance
  double radiance = 0;  // for the odds
  std::uint32_t flags = 0;
  std::uint32_t material = HW_NONE;
  bool back = false;  // sampled from the back only
};
SlotEmission slot_emission(const EmissiveInstance& instance, std::span<const MaterialRecord> materials,
                           std::size_t slot);

// One lamp's record and shape, and its flux estimate [W]. `reason` says why it does not emit, empty when it does.
struct Lamp {
  LightRecord record;
  LampShape shape;
  float flux = 0;
  std::string reason;
};
Lamp make_lamp(const LightData& data, float scene_radius);

}  // namespace hw
