// SPDX-License-Identifier: Apache-2.0
// What reservoir integrators keep beside the reservoirs themselves (shared/reservoir.h): surfaces as targets of
// resampling, and cells of the world-space structures.
#ifndef HW_REUSE_H
#define HW_REUSE_H
#include "following_tree.h"
#include "kd_tree.h"
#include "portable.h"
#include "reservoir.h"
#include "world_grid.h"
HW_NAMESPACE_BEGIN

// A shading point reduced to what its target function needs (lib/reuse_target.h): one diffuse and one glossy lobe.
struct ReuseSurface {
  vec3 position;        // world space
  uint key;             // of the object (InstanceRecord::key); HW_NONE: no surface here
  uint normal;          // shading normal, octahedral, 2 x 16 bit
  uint wo;              // towards the viewer, octahedral
  uint reflectance;     // two half floats: luminance of the diffuse and of the glossy albedo
  uint alpha_transmit;  // two half floats: roughness alpha of the glossy lobe; share let through to the other side
};
HW_CONST uint HW_REUSE_SURFACE_BYTES = 32u;
HW_CHECK_SIZE(ReuseSurface, HW_REUSE_SURFACE_BYTES)

// A light reduced to what its target function needs: its middle, and how much it sends out in which directions. Made
// from the light table once a frame (stages/light_proxies.comp).
struct LightProxy {
  vec3 center;           // world space [m]; suns: unit direction towards them
  float radius;          // of a sphere about it [m]; suns: sine of the half angle; the world: 0
  uint axis;             // the direction it emits along, octahedral
  uint emission;         // two half floats a, b: emits clamp(a cos + b, 0, 1) at an angle to the axis
  float intensity;       // luminance [W sr^-1] at its brightest; suns: irradiance; the world: mean radiance
  float area;            // that faces the receiver [m^2]; suns: solid angle; 0 for true points
  float inverse_choice;  // 1 / the probability of being chosen; 0: never
  uint flags;            // HW_PROXY_*; emission map of a triangle << HW_PROXY_MAP_SHIFT
  float threshold;       // the alias table's entry of the same index, to draw from it in one load
  uint alias;
};
HW_CONST uint HW_LIGHT_PROXY_BYTES = 48u;
HW_CHECK_SIZE(LightProxy, HW_LIGHT_PROXY_BYTES)
HW_CONST uint HW_PROXY_SUN = 1u;
HW_CONST uint HW_PROXY_WORLD = 2u;
HW_CONST uint HW_PROXY_TWO_SIDED = 4u;
HW_CONST uint HW_PROXY_WEIGHED = 8u;  // MIS against BSDF rays
HW_CONST uint HW_PROXY_MAP_SHIFT = 8u;

// A cell of the grid or a leaf of the tree. `held` is what surfaces read; it changes between passes over the picture
// only, so that a pass sees the same state in any order of tiles. The rest gathers the samples of the pass under way.
struct ReuseCell {
  uint64_t sum;   // fixed-point sum of resampling weights (lib/reservoir_race.h)
  uint64_t best;  // race key of the winner so far; all bits set: none
  Reservoir held;
  uint tag;            // what the cell stands for (lib/world_grid.h); another one: the cell has moved on and is empty
  uint inputs;         // samples offered in the last pass
  uint count;          // samples taken in this pass
  uint offered;        // samples offered in this pass
  uint light;          // the winner
  float u, v, target;  // of the winner: where on the light, p_hat at its surface
};
HW_CONST uint HW_REUSE_CELL_BYTES = 72u;
HW_CHECK_SIZE(ReuseCell, HW_REUSE_CELL_BYTES)
HW_CONST uint HW_REUSE_CELL_HELD = 16u;
HW_CHECK_OFFSET(ReuseCell, held, HW_REUSE_CELL_HELD)

// What a cell of an unbiased estimator holds: one path's light sample with the surface it was made for, so that its own
// p_hat is known wherever it is read.
struct ReuseRecord {
  Reservoir held;
  ReuseSurface surface;
};
HW_CONST uint HW_REUSE_RECORD_BYTES = 56u;
HW_CHECK_SIZE(ReuseRecord, HW_REUSE_RECORD_BYTES)
HW_CONST uint HW_REUSE_RECORD_SURFACE = 24u;
HW_CHECK_OFFSET(ReuseRecord, surface, HW_REUSE_RECORD_SURFACE)

// A cell but for its record: the race for it in the pass under way, by keys that know nothing of the samples, and what
// is known of those before.
struct RecordCell {
  uint best;     // least key so far
  uint worst;    // greatest
  uint offered;  // paths that came by in this pass
  uint made;     // 1 + the pass the record was made in; 0: there is no record
  uint seen;     // the last pass in which a path came by; before any did: in which the cell came to be
  uint load;     // paths in that pass
  uint tag;      // as ReuseCell's
};
HW_CHECK_SIZE(RecordCell, 28)

// What a leaf saw in the last pass in which a path came by, for the tree to follow.
struct LeafSurvey {
  vec3 position;  // of one of the surfaces [m]
  uint pass;      // before any: in which the leaf came to be
  vec3 witness;   // of another, where there was another
  uint load;      // surfaces; 0: none ever
};
HW_CHECK_SIZE(LeafSurvey, 32)

// What the stages of reuse read besides the frame's parameters (FrameParams::reuse). A pass is one sample of every
// pixel of the picture: what it reads was left by the pass before, in this frame or the last.
struct ReuseFrame {
  uint64_t reservoirs;       // Reservoir[path]: the light sample that shading takes
  uint64_t targets;          // ReuseSurface[path]
  uint64_t race_keys;        // uint64_t[path]: of the sample that the path offered to a cell
  uint64_t path_cells;       // uint[path]: the cell it was offered to, HW_NONE: none
  uint64_t visible_queue;    // paths whose candidate's visibility is asked for
  uint64_t screen;           // Reservoir[pixels of the region]: the last pass
  uint64_t screen_surfaces;  // ReuseSurface[pixels]
  uint64_t next_screen;      // the same of this pass
  uint64_t next_screen_surfaces;
  uint64_t cells;        // ReuseCell[cell_count]
  uint64_t touched;      // queue of the cells that were offered samples in this pass
  KdTree tree;           // wssr-kd: cells are its leaves
  uint64_t proxies;      // LightProxy[lights]
  uint64_t light_remap;  // uint[]: where a light of the last frame is in this frame's table, HW_NONE: gone; 0: in place
  uint cell_count;
  uint light_remap_count;
  uint candidates, indirect_candidates;
  uint neighbours;
  uint flags;             // HW_REUSE_*
  float radius;           // of spatial neighbours [pixels]
  float confidence_cap;   // most confidence a reservoir of the last pass may bring; 0: no cap
  float history_passes;   // cells: most passes' worth of inputs they remember; 0: all
  float light_mis_scale;  // light samples that MIS counts next-event estimation as; 1 for `path`
  uint ascension;         // levels of the tree
  uint grid_radius;       // cells
  uint cell_inputs;       // 0: all
  uint cell_slots;        // reservoirs a cell
  uint pass;              // counts passes of the render, for random numbers of cells
  int fixed_exponent;     // scale of fixed-point sums (lib/reservoir_race.h)
  WorldGrid grid;         // wssr-grid: cells are its cells
  uint record_age;        // passes for which a record is read
  uint pad[2];
  uint64_t records;       // unbiased cells: ReuseRecord[cell_count], as the last pass left them
  uint64_t next_records;  // ... of the pass under way
  uint64_t record_cells;  // RecordCell[cell_count]
  uint64_t witnesses;     // vec3[cell_count], the tree's: positions of the surfaces whose keys are the greatest
  FollowingTree leaves;   // unbiased wssr-kd: cells are its leaves
};
HW_CHECK_SIZE(ReuseFrame, 288)
HW_CONST uint HW_REUSE_WEIGHTS_INVERSE_M = 0u;
HW_CONST uint HW_REUSE_WEIGHTS_INVERSE_Z = 1u;
HW_CONST uint HW_REUSE_WEIGHTS_MIS = 2u;      // defensive pairwise
HW_CONST uint HW_REUSE_WEIGHTS_BALANCE = 3u;  // unbiased estimators alone
HW_CONST uint HW_REUSE_TEMPORAL = 1u;
HW_CONST uint HW_REUSE_SPATIAL = 2u;
HW_CONST uint HW_REUSE_NEW_FRAME = 4u;   // the last pass belongs to another frame: follow motion to it
HW_CONST uint HW_REUSE_HISTORY = 8u;     // there is a last pass
HW_CONST uint HW_REUSE_REPROJECT = 16u;  // restir: indirect hits look up the picture; grid: its nearest cells
HW_CONST uint HW_REUSE_BLACK = 32u;      // black where no neighbour holds a sample
HW_CONST uint HW_REUSE_VISIBLE = 64u;    // candidates are tested for visibility before they are stored

HW_NAMESPACE_END
#endif
