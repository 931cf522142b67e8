// SPDX-License-Identifier: Apache-2.0
// The uniform grid of SivaramWSSR, section 4.2: the cell of a position, its place in memory, its neighbours.
//
// Two ways to follow the camera. Riding, as the paper's code has it: a cell keeps its place relative to the camera, so
// what it holds moves through the world with it. Departing from that, world cells: a cell is a fixed cube of the world,
// the window of cells about the camera moves over them, and memory is addressed modulo the resolution on each axis.
// So a cell keeps its reservoirs as long as it stays in the window, and takes over those of the cell that left it.
// Which of the two they are is told by a tag beside them; who reads another tag than grid_tag's finds an empty cell.
#ifndef HW_WORLD_GRID_H
#define HW_WORLD_GRID_H
#include "../shared/world_grid.h"
#include "sampler.h"
#ifdef __cplusplus
namespace hw {
using glm::ivec3;
}
#endif
HW_NAMESPACE_BEGIN

// Coordinates are within +-2^30: what lies further out is outside of every grid.
HW_CONST int HW_GRID_FAR = 1073741824;
HW_CONST int HW_GRID_NONE = 2147483647;  // x of no cell
HW_CONST uint HW_GRID_TAG_WORLD = 0x40000000u;
HW_CONST uint HW_GRID_TAG_RIDING = 0x80000000u;

// floor(c / n) and c - n floor(c / n): GLSL leaves % of negative numbers open.
HW_FN int grid_wraps(int c, uint n) { return c >= 0 ? int(uint(c) / n) : -1 - int(uint(-(c + 1)) / n); }
HW_FN uint grid_modulo(int c, uint n) { return c >= 0 ? uint(c) % n : n - 1u - uint(-(c + 1)) % n; }

// Whether |x| < 2^30, which no NaN is.
HW_FN bool grid_near(float x) { return (floatBitsToUint(x) & 0x7FFFFFFFu) < 0x4E800000u; }

// floor(x) within +-2^30; one of these ends for NaN.
HW_FN int grid_floor(float x) {
  return grid_near(x) ? int(floor(x)) : floatBitsToUint(x) < 0x80000000u ? HW_GRID_FAR : -HW_GRID_FAR;
}

HW_FN ivec3 grid_low(WorldGrid g) { return ivec3(g.low[0], g.low[1], g.low[2]); }
HW_FN ivec3 grid_high(WorldGrid g) { return grid_low(g) + ivec3(int(g.resolution) - 1); }

// A grid about `camera` (world space) that reaches `extent` metres to each side, world cells to within half a cell:
// cells of 2 extent / resolution, the camera's among them. What makes no sense is mended, so that a grid always has a
// cell: a camera that is not finite counts as the origin, an extent that is no positive number as 1 m; resolution and
// slots are clamped.
HW_FN WorldGrid world_grid(vec3 camera, float extent, uint resolution, uint slots, bool riding) {
  bool finite = (floatBitsToUint(camera.x) & 0x7FFFFFFFu) < 0x7F800000u &&
                (floatBitsToUint(camera.y) & 0x7FFFFFFFu) < 0x7F800000u &&
                (floatBitsToUint(camera.z) & 0x7FFFFFFFu) < 0x7F800000u;
  vec3 eye = finite ? camera : vec3(0.0f);
  bool sound = extent >= 1e-18f && extent <= 1e18f;
  float reach = sound ? extent : 1.0f;
  WorldGrid g;
  g.resolution = clamp(resolution, 1u, HW_GRID_MAX_RESOLUTION);
  g.slots = clamp(slots, 1u, HW_GRID_MAX_SLOTS);
  g.riding = riding ? 1u : 0u;
  g.cell_size = 2.0f * reach / float(g.resolution);
  g.cells_a_metre = 1.0f / g.cell_size;
  g.origin = riding ? eye - vec3(reach) : vec3(0.0f);
  vec3 middle = eye * g.cells_a_metre + vec3(g.resolution % 2u == 0u ? 0.5f : 0.0f);
  int back = int(g.resolution / 2u);
  g.low[0] = riding ? 0 : grid_floor(middle.x) - back;
  g.low[1] = riding ? 0 : grid_floor(middle.y) - back;
  g.low[2] = riding ? 0 : grid_floor(middle.z) - back;
  return g;
}

// The cell P (world space) lies in. False, and some cell of the grid, if it lies outside, is NaN, or is 2^30 cells or
// more away from the origin.
HW_FN bool grid_cell(WorldGrid g, vec3 P, HW_OUT(ivec3) cell) {
  vec3 q = (P - g.origin) * g.cells_a_metre;
  ivec3 found = ivec3(grid_floor(q.x), grid_floor(q.y), grid_floor(q.z));
  ivec3 low = grid_low(g);
  cell = clamp(found, low, grid_high(g));
  return grid_near(q.x) && grid_near(q.y) && grid_near(q.z) && cell.x == found.x && cell.y == found.y &&
         cell.z == found.z;
}

// The cell of the grid nearest to P, wherever P is; the one it lies in, if it is inside (section 4.2.1).
HW_FN ivec3 grid_project(WorldGrid g, vec3 P) {
  ivec3 cell;
  grid_cell(g, P, cell);
  return cell;
}

// A cell's place in memory, below resolution^3: differs for all cells of a window. `cell` may lie outside of it.
HW_FN uint grid_index(WorldGrid g, ivec3 cell) {
  uint n = g.resolution;
  return (grid_modulo(cell.z, n) * n + grid_modulo(cell.y, n)) * n + grid_modulo(cell.x, n);
}

// Tells the cells apart that share a place: how often the window's width fits below the cell, 10 bits an axis. Two that
// share one have the same tag only if they are a multiple of 1024 windows apart on each axis. Never 0.
HW_FN uint grid_tag(WorldGrid g, ivec3 cell) {
  uint n = g.resolution;
  uint wraps = (uint(grid_wraps(cell.x, n)) & 1023u) | ((uint(grid_wraps(cell.y, n)) & 1023u) << 10u) |
               ((uint(grid_wraps(cell.z, n)) & 1023u) << 20u);
  return g.riding != 0u ? HW_GRID_TAG_RIDING : HW_GRID_TAG_WORLD | wraps;
}

// The cell of the window that lies at a place of memory: the inverse of grid_index.
HW_FN ivec3 grid_at(WorldGrid g, uint place) {
  uint n = g.resolution;
  ivec3 low = grid_low(g);
  return low + ivec3(int(grid_modulo(int(place % n) - int(grid_modulo(low.x, n)), n)),
                     int(grid_modulo(int(place / n % n) - int(grid_modulo(low.y, n)), n)),
                     int(grid_modulo(int(place / n / n) - int(grid_modulo(low.z, n)), n)));
}

// Another cell of the grid, uniform over those at most `radius` cells away from `cell` on each axis, for u in [0, 1)^3;
// odds differ by a share of 2^-34 times the number of cells. x = HW_GRID_NONE: there is none. A cell outside of the
// grid counts as the nearest one in it.
HW_FN ivec3 grid_neighbour(WorldGrid g, ivec3 cell, uint radius, vec3 u) {
  int r = int(min(radius, g.resolution));
  ivec3 from = clamp(cell, grid_low(g), grid_high(g));
  ivec3 low = max(from - ivec3(r), grid_low(g));
  ivec3 high = min(from + ivec3(r), grid_high(g));
  uint nx = uint(high.x - low.x + 1);
  uint ny = uint(high.y - low.y + 1);
  uint others = nx * ny * uint(high.z - low.z + 1) - 1u;
  if (others == 0u) {
    return ivec3(HW_GRID_NONE);
  }
  // Cells of the box in order, the own one left out. 34 random bits times at most 30: a float has too few for that.
  vec3 v = clamp(u, vec3(0.0f), vec3(0.99999994f));
  uint64_t bits = (uint64_t(uint(v.x * 4096.0f)) << 22u) | uint64_t((uint(v.y * 2048.0f) << 11u) | uint(v.z * 2048.0f));
  uint chosen = uint((bits * uint64_t(others)) >> 34u);
  uint own = (uint(from.z - low.z) * ny + uint(from.y - low.y)) * nx + uint(from.x - low.x);
  chosen = chosen < own ? chosen : chosen + 1u;
  return low + ivec3(int(chosen % nx), int(chosen / nx % ny), int(chosen / nx / ny));
}

// Which of the cell's reservoirs P takes, below `slots`: that of the nearest of as many random points in the cell (the
// Voronoi partition of section 4.2). P outside of the cell counts as its nearest point in it.
HW_FN uint grid_slot(WorldGrid g, ivec3 cell, vec3 P) {
  vec3 at = clamp((P - g.origin) * g.cells_a_metre - vec3(float(cell.x), float(cell.y), float(cell.z)), vec3(0.0f),
                  vec3(1.0f));
  uint seed = sampler_hash_combine(sampler_hash_combine(sampler_hash(uint(cell.x)), uint(cell.y)), uint(cell.z));
  uint nearest = 0u;
  float least = HW_INFINITY;
  for (uint i = 0u; i < g.slots; ++i) {
    uint h = sampler_hash_combine(seed, i);
    vec3 site =
        (vec3(float(h & 1023u), float((h >> 10u) & 1023u), float((h >> 20u) & 1023u)) + vec3(0.5f)) * (1.0f / 1024.0f);
    vec3 d = at - site;
    float squared = dot(d, d);
    nearest = squared < least ? i : nearest;
    least = min(squared, least);
  }
  return nearest;
}

// Place of P's reservoir among those of all cells, below resolution^3 slots (which must be below 2^32).
HW_FN uint grid_reservoir(WorldGrid g, ivec3 cell, vec3 P) {
  return grid_index(g, cell) * g.slots + grid_slot(g, cell, P);
}

HW_NAMESPACE_END
#endif
