// SPDX-License-Identifier: Apache-2.0
// The light tree: a binary tree of bounds over all lights that can be chosen (lamps, suns, the world, emissive
// triangles), one light in each leaf (Conty Estevez and Kulla 2018); below a node over few lights a walk weighs
// them all at once, from a table of their own. Built by core/lights/light_tree.h, read by lib/light_tree.h.
//
// Node 0 is the root; children stand behind their parent, two beside each other. A light's place in leaf order is its
// `position`; the lights below a node follow one another in it. Bounds are rounded outwards to 16 bytes: a walk down
// the tree costs what it reads.
#ifndef HW_LIGHT_TREE_SHARED_H
#define HW_LIGHT_TREE_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

// A box this large [m] bounds nothing: lights further out, and the root over lights at infinity and others.
HW_CONST float HW_LIGHT_TREE_UNBOUNDED = 1e18f;

// Where the lights below are, where they send light, and how much. By word:
// place     three numbers of 21 bits, in steps of LightTreeScale from its corner: the middle of a sphere about them;
//           distant: direction towards them, each of [-1, 1]. The highest bit: along the axis and against it.
// strength  low half: power, the upper half of a float, whose sign says distant. The sum over lights of the largest
//           radiant intensity [W sr^-1], of distant ones of irradiance [W m^-2], all times one factor that keeps them
//           in range. High half: radius of the sphere, likewise [m].
// cone      two bytes: axis of emission, octahedral, of [-1, 1] each (distant: towards the light). Two bytes: sin(theta
// / 2) * 255 of
//           theta_o (of normals about the axis; distant: of directions) and of theta_e (of emission about a normal).
struct LightTreeBounds {
  uint place_low, place_high;
  uint strength;
  uint cone;
};
HW_CONST uint HW_LIGHT_TREE_BOUNDS_BYTES = 16u;
HW_CHECK_SIZE(LightTreeBounds, HW_LIGHT_TREE_BOUNDS_BYTES)
HW_CONST uint HW_LIGHT_TREE_TWO_SIDED = 0x80000000u;  // in place_high
HW_CONST uint HW_LIGHT_TREE_DISTANT = 0x8000u;        // in strength

// Links of a node: its left child, the right one is the next; HW_NONE: a leaf. Position of the right child's first
// light; of a leaf, of its light. Above HW_LIGHT_TREE_LINK, of a node over few lights (2 to HW_LIGHT_TREE_FEW): how
// many less one; how many are to the left. 0 over more.
struct LightTreeNode {
  LightTreeBounds bounds;
  uint child;
  uint middle;
};
HW_CONST uint HW_LIGHT_TREE_LINK = 0x1FFFFFFFu;
HW_CONST uint HW_LIGHT_TREE_LINK_BITS = 29u;
HW_CONST uint HW_LIGHT_TREE_FEW = 8u;
HW_CONST uint HW_LIGHT_TREE_NODE_BYTES = 24u;
HW_CHECK_SIZE(LightTreeNode, HW_LIGHT_TREE_NODE_BYTES)

// What places of nodes are counted in [m].
struct LightTreeScale {
  vec3 corner;
  vec3 step;
};
HW_CHECK_SIZE(LightTreeScale, 24)

HW_NAMESPACE_END
#endif
