// SPDX-License-Identifier: Apache-2.0
// The scene's light tree in shaders: lib/light_tree.h over the tables of the root.
#ifndef HW_LIGHT_TREE_GLSL
#define HW_LIGHT_TREE_GLSL
#include "light_tree.h"
#include "tables.glsl"

LightTreeTables light_tree_tables() {
  return LightTreeTables(HW_ROOT.light_tree, HW_ROOT.light_leaves, HW_ROOT.light_order, HW_ROOT.light_position, HW_ROOT.light_tree_scale);
}

// A light below `node` for a surface at P with the unit normal N (no matter where it `transmits`): its index with the
// chance of it given the node, or HW_NONE with pdf 0. u in [0, 1) is used and left uniform.
uint light_tree_sample(uint node, vec3 P, vec3 N, bool transmits, inout float u, out float pdf) {
  return light_tree_draw(light_tree_tables(), node, LightTreeReceiver(P, N, transmits), u, pdf);
}

// The chance with which light_tree_sample gives `light`.
float light_tree_pdf(uint node, uint light, vec3 P, vec3 N, bool transmits) {
  return light_tree_chance(light_tree_tables(), node, light, LightTreeReceiver(P, N, transmits));
}
#endif
