// SPDX-License-Identifier: Apache-2.0
// What material programs emit over the triangles of a mesh, as a stage measured it (stages/triangle_emission.h): kept
// by mesh, materials and object colour, so that instances and copies share it, and until one of those changes. What
// else a program may read of an object (its place, its random number) is taken from the first that has them. It only
// says where samples go: what they bring is the program's own.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "scene/scene.h"

namespace hw {

struct EmissionKey {
  Id mesh;
  std::vector<Id> materials;
  std::array<float, 3> color;
  auto operator<=>(const EmissionKey&) const = default;
};

struct MeasuredEmission {
  std::uint64_t revision = 0;      // newest of mesh, programs and images when it was measured; 0: it was not
  std::vector<float> radiance;     // of each triangle of the mesh, mean of the channels; those that do not vary: 0
  std::vector<std::uint32_t> map;  // of each triangle: where its map begins in `maps`, HW_NONE: it has none
  std::vector<float> maps;         // lib/emission_map.h
  std::uint32_t maps_at = 0;       // where they begin in the table
  bool used = false;               // by the scene as it is
};

// A grid over each of some triangle lights, to be measured.
struct EmissionGrid {
  std::vector<std::uint32_t> lights;
  std::uint32_t size = 0;  // cells along a side
  std::uint32_t taps = 0;  // points along a side of a cell
};

// Where measuring stands: coarsely, all triangles to find how bright they are and which need maps; then those.
struct EmissionMeasuring {
  struct Part {
    MeasuredEmission* of;
    std::uint64_t revision;
    std::uint32_t instance;  // that stands for all
    std::uint32_t triangles;
  };
  struct Mapped {
    MeasuredEmission* of;
    std::uint32_t triangle;
  };
  std::vector<Part> parts;
  std::vector<Mapped> mapped;  // one for each light of the fine grid
  EmissionGrid grid;           // what is wanted now; no lights: nothing
};

}  // namespace hw
