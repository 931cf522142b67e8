// SPDX-License-Identifier: Apache-2.0
// A uniform grid of resolution^3 cells about the camera, each with one reservoir or a few. Made and read by
// lib/world_grid.h.
#ifndef HW_WORLD_GRID_SHARED_H
#define HW_WORLD_GRID_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_GRID_MAX_RESOLUTION = 1024u;
HW_CONST uint HW_GRID_MAX_SLOTS = 16u;

// Cells are named by integer coordinates: floor((P - origin) / cell_size). Those of the window
// [low, low + resolution) on each axis are there.
struct WorldGrid {
  vec3 origin;          // world space; 0 unless riding
  float cell_size;      // edge of a cell [m]
  float cells_a_metre;  // 1 / cell_size
  int low[3];           // the window's first cell
  uint resolution;      // 1 to HW_GRID_MAX_RESOLUTION
  uint slots;           // reservoirs a cell, 1 to HW_GRID_MAX_SLOTS
  uint riding;          // 1: cells move with the camera, 0: they stay in the world and the window moves over them
};
HW_CHECK_SIZE(WorldGrid, 44)

HW_NAMESPACE_END
#endif
