// SPDX-License-Identifier: Apache-2.0
// What reservoir integrators keep beside the reservoirs themselves (shared/reservoir.h): surfaces as targets of
// resampling, and cells of the world-space structures.
#ifndef HW_REUSE_H
#define HW_REUSE_H
#include "portable.h"
#include "reservoir.h"
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
HW_CHECK_SIZE(ReuseSurface, 32)

// A cell of the grid or a leaf of the tree. `held` is what surfaces read; it changes between passes over the picture
// only, so that a pass sees the same state in any order of tiles. The rest gathers the samples of the pass under way.
struct ReuseCell {
  uint64_t sum;   // fixed-point sum of resampling weights (lib/reservoir.h)
  uint64_t best;  // race key of the winner so far; all bits set: none
  Reservoir held;
  uint tag;            // what the cell stands for (lib/world_grid.h); another one: the cell has moved on and is empty
  uint inputs;         // samples offered in the last pass
  uint count;          // samples taken in this pass
  uint offered;        // samples offered in this pass
  uint light;          // the winner
  float u, v, target;  // of the winner: where on the light, p_hat at its surface
};
HW_CHECK_SIZE(ReuseCell, 72)

HW_NAMESPACE_END
#endif
