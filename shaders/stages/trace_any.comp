// SPDX-License-Identifier: Apache-2.0
// Whether anything blocks each queued ray, by ray query.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_query.glsl"

layout(local_size_x = 64) in;

void main() {
  uint path;
  Ray ray;
  if (!queued_ray(gl_GlobalInvocationID.x, path, ray)) return;
  rayQueryEXT query;
  run_query(query, ray, gl_RayFlagsTerminateOnFirstHitEXT);
  bool occluded = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
  OccludedRef(push.hits).items[path] = occluded ? 1u : 0u;
}
