// SPDX-License-Identifier: Apache-2.0
// Which light is which over several updates of the tables. A light's index in the light table changes when others come
// and go; a sample that is kept over frames names its light by index and follows it by LightChanges::remap.
//
// A lamp is known by its id and kind, the world as the world, an emissive triangle by its instance's id and its index
// in the mesh, as long as the mesh keeps its topology (indices and slots of its triangles; positions may change). With
// another topology, its triangles are other lights.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/scene.h"
#include "shared/lights.h"

namespace hw {

// What became of the lights from one table to a later one.
struct LightChanges {
  // New index of each light of the old table, HW_NONE for one that is gone. Empty: all are where they were.
  std::vector<std::uint32_t> remap;
  // Some light emits more than it did, or from where it did not: it came, its flux or its emission in some channel
  // grew, its cone or spread changed, more rays see it. A program is not evaluated: an emission that one works out
  // counts as brighter when the program, its images or the object's own data (its colour, say) were set again. A light
  // that moves, and a mesh that deforms to no larger area, are not brighter.
  bool brightened = false;
  // The furthest any lamp that emits went [m]; a turn counts as the way of a point a metre from it. Emissive meshes are
  // not looked at.
  float moved = 0;
  // Any light is not as it was: came or went, moved, other emission. May be set with nothing changed when data were set
  // again to what they had been. Implied by `brightened`.
  bool changed = false;
};

// The lights of one table, with what tells whether they changed. Of emissive triangles it holds no more than a number
// for each instance, so that comparing does not depend on their count.
struct LightSnapshot {
  struct Lamp {
    Id id;
    std::uint32_t index;
    LightRecord record;
    float flux;  // as the table weighs it, a sun's over the square of the scene's radius; 0: does not emit
  };
  struct World {
    std::uint32_t index = HW_NONE;  // HW_NONE: not in the table; its light counts as changed all the same
    std::uint32_t flags = 0;        // HW_LIGHT_*
    vec3 color{0};                  // radiance of a constant world
    std::uint64_t program = 0;      // newest revision of what a world with a program depends on; 0: constant
  };
  // What a material slot emits; all zero when nothing.
  struct Slot {
    float radiance = 0;         // estimate for the odds; > 0 where it emits
    vec3 emission{0};           // constant emission
    std::uint32_t flags = 0;    // HW_LIGHT_*
    bool back = false;          // from the back alone
    std::uint64_t program = 0;  // newest revision of program and images; 0: constant
  };
  // Instances first .. first + instances - 1, whose triangle lights stand one behind the other.
  struct Emitters {
    Id first;
    std::uint32_t instances, triangles;  // triangles: of each instance
    std::uint32_t index;                 // of the first light
    std::uint32_t slot_begin, slot_count;
    std::uint32_t flux_begin;                 // one number for each instance
    std::uint64_t topology;                   // topology_hash() of the mesh
    std::uint64_t placed, shape, appearance;  // revisions: of the matrices, the mesh, and the object's other data
  };
  std::vector<Lamp> lamps;  // by id
  World world;
  std::vector<Emitters> emitters;  // by first id
  std::vector<Slot> slots;
  std::vector<float> flux;  // of each emissive instance: the sum over its triangles [W]
  std::uint32_t count = 0;  // lights in the table
};

// O(lamps + emissive instances), plus O(lights) when some light moved place.
LightChanges compare_lights(const LightSnapshot& before, const LightSnapshot& now);

// A hash of which vertices make which triangle and of their slots.
std::uint64_t topology_hash(std::span<const std::uint32_t> tri_vertices, std::span<const std::uint8_t> tri_slots);

}  // namespace hw
