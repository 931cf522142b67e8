// SPDX-License-Identifier: Apache-2.0
// Path reuse: every anchor takes the light of its group's shared vertices. One thread a path of the camera.
// a: paths of the camera; b: paths of each anchor; c: first of this dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/path_reuse.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint number = push.c + gl_GlobalInvocationID.x;
  if (number >= push.a) return;
  uint anchor = number * HW_FRAME.places;
  if ((path_flags(anchor) & HW_PATH_ANCHOR) == 0u) return;
  uint own = reuse_member(number);
  SharedVertexArray vertices = SharedVertexArray(HW_FRAME.shared_vertices);
  SharedPairArray pairs = SharedPairArray(HW_FRAME.shared_pairs);
  // Light is bounded where it was found; here is what no path brings, whatever its neighbours are.
  float limit = HW_FRAME.clamp_indirect / float(push.b);
  vec3 sum = vec3(0.0);
  for (uint member = 0u; member < HW_REUSE_PIXELS; ++member) {
    uint other = reuse_other(number, member);
    if (other == HW_NONE) continue;
    uint first = other * HW_FRAME.places;
    if ((path_flags(first) & HW_PATH_ANCHOR) == 0u) continue;
    for (uint way = 0u; way < push.b; ++way) {
      uint path = first + 1u + way;
      if (vertices.at[path].kind != HW_SHARED_GIVEN) continue;
      uint index = path * HW_REUSE_PIXELS + own;
      if (!(pairs.at[index].pdf > 0.0) || uint_at(HW_FRAME.shared_hits, index) != 0u) continue;
      vec3 f = pairs.at[index].f;
      vec3 v = result_value(clamp_contribution(f * vertices.at[path].arrival, limit));
      sum += v;
      if (HW_LIGHT_PASSES) {
        vec3 diffuse = SharedShareArray(HW_FRAME.shared_shares).at[index];
        result_add_light_passes(anchor, v, 2u, shares_of(diffuse, f), shares_of(f - diffuse, f));
      }
    }
  }
  result_add3(anchor, HW_PASS_COMBINED, sum);
}
