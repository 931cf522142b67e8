// SPDX-License-Identifier: Apache-2.0
// Where on a triangle its emission is bright: piecewise constant over the unit square, which an area-preserving map
// (lib/triangle_light.h) takes to the triangle, so that the density is exact. Made by core/lights/emission_map.h.
//
// A map in the table of floats: the number n of cells along a side; n + 1 floats of the cumulative
// distribution of rows; n times n + 1 of the cells in each row.
#ifndef HW_EMISSION_MAP_H
#define HW_EMISSION_MAP_H
#include "cumulative.h"
HW_NAMESPACE_BEGIN

// A point of the square, by the map at float `map` of the table at address `maps`. u in [0, 1)^2. `density`: of the
// point, 1 on average over the square.
HW_FN vec2 emission_map_sample(uint64_t maps, uint map, vec2 u, HW_OUT(float) density) {
  uint n = uint(HW_CUMULATIVE(maps, map));
  uint rows = map + 1u;
  uint y = cumulative_find(maps, rows, n, u.y);
  float m0 = HW_CUMULATIVE(maps, rows + y);
  float row = HW_CUMULATIVE(maps, rows + y + 1u) - m0;
  uint cells = rows + (y + 1u) * (n + 1u);
  uint x = cumulative_find(maps, cells, n, u.x);
  float c0 = HW_CUMULATIVE(maps, cells + x);
  float cell = HW_CUMULATIVE(maps, cells + x + 1u) - c0;
  float across = float(n);
  density = row * cell * across * across;
  vec2 within = vec2((u.x - c0) / max(cell, 1e-30f), (u.y - m0) / max(row, 1e-30f));
  within = clamp(within, vec2(0.0f), vec2(1.0f));
  return vec2((float(x) + within.x) / across, (float(y) + within.y) / across);
}

// The density with which emission_map_sample makes a point of the square.
HW_FN float emission_map_density(uint64_t maps, uint map, vec2 at) {
  uint n = uint(HW_CUMULATIVE(maps, map));
  float across = float(n);
  uint x = min(uint(max(at.x, 0.0f) * across), n - 1u);
  uint y = min(uint(max(at.y, 0.0f) * across), n - 1u);
  uint rows = map + 1u;
  uint cells = rows + (y + 1u) * (n + 1u);
  float row = HW_CUMULATIVE(maps, rows + y + 1u) - HW_CUMULATIVE(maps, rows + y);
  float cell = HW_CUMULATIVE(maps, cells + x + 1u) - HW_CUMULATIVE(maps, cells + x);
  return row * cell * across * across;
}

HW_NAMESPACE_END
#endif
