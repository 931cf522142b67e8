// SPDX-License-Identifier: Apache-2.0
// What `wssr-hash` keeps in world space: cells of a hash table, each with a learned distribution over a cut through the
// light tree (shared/light_tree.h). Light samples are proposed by it; what shadow rays say of them teaches it.
#ifndef HW_LIGHT_CELLS_SHARED_H
#define HW_LIGHT_CELLS_SHARED_H
#include "light_tree.h"
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_LIGHT_CELL_SLOTS = 32u;  // nodes of the tree that a cell tells apart, at most
HW_CONST uint HW_LIGHT_CELL_WAYS = 4u;    // cells of a bucket of the hash table

// A cell. Its cut is a set of nodes that together hold every light once, ordered by their lights. Between updates
// (stages/light_cell_update.comp) only `samples`, `used` and the sums change, by atomics whose order does not matter.
//
// `response` is what the cell knows of a node: the light that arrives from there (luminance, by way of the surfaces'
// closures, shadows and all) over the node's importance. It is learned as the ratio of two sums: of the light that
// came, and of the importance that was sampled for it.
struct LightCell {
  LightTreeBounds slot[32];  // the nodes, of a power that is what arrives of it as far as the cell knows; of 0: no slot
  uint node[32];
  uint first[32];  // place of the node's first light in the tree's order
  float response[32];
  float left[32];  // light that came from the node's two halves
  float right[32];
  float asked[32];        // importance that was sampled for it
  uint64_t sum_left[32];  // the light since the last update, in fixed point (lib/reservoir_race.h)
  uint64_t sum_right[32];
  uint64_t sum_expected[32];  // the light that was to be expected by what the cell knew
  uint used;                  // the pass it was last looked up in
  uint samples;               // light samples that surfaces asked it for since the last update
  uint slots;                 // nodes of the cut
  float evidence;             // light samples that its knowledge comes from, old ones counting less
  float mean;                 // light of one sample, in the mean
  vec3 center;                // world space
  int exponent;               // of the sums' scale: about what one light sample brings
  uint pad;
};
HW_CONST uint HW_LIGHT_CELL_BYTES = 2088u;
HW_CHECK_SIZE(LightCell, HW_LIGHT_CELL_BYTES)
HW_CHECK_OFFSET(LightCell, slot, 0u)
// Where stages that draw from cells find members: index of the 32-bit number.
HW_CONST uint HW_LIGHT_CELL_UINT_NODE = 128u;
HW_CONST uint HW_LIGHT_CELL_UINT_FIRST = 160u;
HW_CONST uint HW_LIGHT_CELL_UINT_SLOTS = 514u;
HW_CONST uint HW_LIGHT_CELL_UINT_MEAN = 516u;
HW_CHECK_OFFSET(LightCell, node, 4 * HW_LIGHT_CELL_UINT_NODE)
HW_CHECK_OFFSET(LightCell, first, 4 * HW_LIGHT_CELL_UINT_FIRST)
HW_CHECK_OFFSET(LightCell, slots, 4 * HW_LIGHT_CELL_UINT_SLOTS)
HW_CHECK_OFFSET(LightCell, mean, 4 * HW_LIGHT_CELL_UINT_MEAN)

// A cell that a surface looked for in vain, or that its bucket is asked to take in with the next update: of all that
// are asked for, the one of the least tag.
struct LightCellRequest {
  uint tag;  // HW_NONE: none
  uint bucket;
  vec3 center;
  uint pad;
};
HW_CONST uint HW_LIGHT_CELL_REQUEST_BYTES = 24u;
HW_CHECK_SIZE(LightCellRequest, HW_LIGHT_CELL_REQUEST_BYTES)

// Where the stages find them (FrameParams::light_cells). Tags lie apart, so that a look-up reads one line.
struct LightCellFrame {
  uint64_t cells;     // LightCell[buckets * HW_LIGHT_CELL_WAYS]
  uint64_t tags;      // uint[buckets * HW_LIGHT_CELL_WAYS]: what the cell stands for; 0: free
  uint64_t requests;  // LightCellRequest[buckets]
  uint64_t missing;   // queue of paths whose cell is not there
  uint64_t wanted;    // LightCellRequest[path]: of those paths
  uint64_t visited;   // uint[path]: the cell that its surface asked; HW_NONE: none
  uint buckets;
  uint pass;         // counts updates
  float size;        // of a cell as seen from the camera: width over distance [rad]; orthographic: width [m]
  float least_size;  // [m]
  float floor;       // of a node's response, over the cell's mean: what seems dark is looked at now and then
  uint keep;         // passes that a cell nobody looks up stays
  float unit;        // light that a surface of middling albedo sends on of an importance of 1: a first guess
  uint pad;
};
HW_CHECK_SIZE(LightCellFrame, 80)

HW_NAMESPACE_END
#endif
