// SPDX-License-Identifier: Apache-2.0
// Path reuse: the light of each shared vertex over all chances that its group had of finding it. One thread a path.
// a: paths; b: paths of each anchor; c: first of this dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/path_reuse.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint thread = push.c + gl_GlobalInvocationID.x;
  if (thread >= push.a) return;
  uint number = thread / push.b;
  uint anchor = number * HW_FRAME.places;
  if ((path_flags(anchor) & HW_PATH_ANCHOR) == 0u) return;
  uint path = anchor + 1u + thread % push.b;
  SharedVertexArray vertices = SharedVertexArray(HW_FRAME.shared_vertices);
  if (vertices.at[path].kind != HW_SHARED_MET) return;
  vec3 light = vertices.at[path].light;
  if (!(dot(abs(light), vec3(1.0)) > 0.0)) return;

  SharedPairArray pairs = SharedPairArray(HW_FRAME.shared_pairs);
  float pdf = 0.0;
  for (uint member = 0u; member < HW_REUSE_PIXELS; ++member) {
    uint index = path * HW_REUSE_PIXELS + member;
    float p = pairs.at[index].pdf;
    if (p > 0.0 && uint_at(HW_FRAME.shared_hits, index) == 0u) pdf += p;
  }
  // Its own pixel must be among those that could: rounding alone says it is not.
  if (pairs.at[path * HW_REUSE_PIXELS + reuse_member(number)].pdf > 0.0 && pdf < HW_RESULT_LIMIT) {
    vec3 arrival = vertices.at[path].arrival * (pdf * float(push.b));
    vertices.at[path].arrival = vec3(arrival.x > 0.0 ? light.x / arrival.x : 0.0, arrival.y > 0.0 ? light.y / arrival.y : 0.0,
                                     arrival.z > 0.0 ? light.z / arrival.z : 0.0);
    vertices.at[path].kind = HW_SHARED_GIVEN;
  } else {
    PathSplit split;
    if (HW_LIGHT_PASSES) split = SplitArray(HW_FRAME.splits).at[path];
    result_add_light(path, light, 2u, true, split.diffuse, split.glossy);
  }
}
