// SPDX-License-Identifier: Apache-2.0
// The light tree: a binary tree of boxes and cones over all lights that can be chosen (lamps, suns, the world, emissive
// triangles), one light in each leaf (Conty Estevez and Kulla 2018). Built by core/lights/light_tree.h, read by
// lib/light_tree.h.
//
// Node 0 is the root; children stand behind their parent, two beside each other. A light's place in leaf order is its
// `position`; the lights below a node are those at positions [first, first + count).
#ifndef HW_LIGHT_TREE_SHARED_H
#define HW_LIGHT_TREE_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

// Where everything below is at infinity (suns, the world), in the sign of theta_e's. Then low = high = the mean
// direction towards it (unit), and theta_o bounds the angle of directions about it.
HW_CONST uint HW_LIGHT_TREE_DISTANT = 0x80000000u;
// Something below sends light along its axis and against it, in the sign of theta_o's.
HW_CONST uint HW_LIGHT_TREE_TWO_SIDED = 0x8000u;
// A box this large [m] bounds nothing: lights further out, and the root over lights at infinity and others.
HW_CONST float HW_LIGHT_TREE_UNBOUNDED = 1e18f;

struct LightTreeNode {
  vec3 low;  // world box of what emits
  vec3 high;
  uint axis;    // of the emission cone, octahedral; distant: towards the light
  uint cone;    // two half floats, rounded up, whose signs are flags: (1 - cos) / 2 of theta_o (of normals about the
                // axis) and of theta_e (of emission about a normal)
  float power;  // sum over lights of the largest radiant intensity [W sr^-1], of distant ones of irradiance [W m^-2];
                // all times one factor that keeps them in range
  uint first;   // position of its first light
  uint count;   // lights below
  uint child;   // left child, the right one is child + 1; HW_NONE: a leaf
};
HW_CONST uint HW_LIGHT_TREE_NODE_BYTES = 48u;
HW_CHECK_SIZE(LightTreeNode, HW_LIGHT_TREE_NODE_BYTES)

HW_NAMESPACE_END
#endif
