// SPDX-License-Identifier: Apache-2.0
// What a material program's emission measured on a grid over each triangle says: how bright the triangle is, and where
// (lib/emission_map.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace hw {

// Mean of a triangle's cells: brightness, what is negative or not finite counting as 0.
float emission_mean(std::span<const float> cells);

// Whether a triangle with these cells is worth a map: it has cells brighter by half than its mean.
bool emission_varies(std::span<const float> cells);

// Appends the map of size * size cells, row by row, to `maps`. No cell has less than 1/32 of the mean: a measurement
// sees points, and what it missed must be found. Returns where it begins. All cells 0: a map that is the same
// everywhere.
std::uint32_t append_emission_map(std::span<const float> cells, std::uint32_t size, std::vector<float>& maps);

// Floats of a map of size * size cells.
constexpr std::size_t emission_map_floats(std::size_t size) { return 1 + (size + 1) * (size + 1); }

}  // namespace hw
