// SPDX-License-Identifier: Apache-2.0
// Whether anything blocks each queued ray, by ray query.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_query.glsl"

layout(local_size_x = 64) in;
layout(buffer_reference, scalar) writeonly buffer OccludedRef { uint items[]; };

void main() {
  uint slot = gl_GlobalInvocationID.x;
  QueueRef queue = QueueRef(push.queue);
  if (slot >= min(queue.header.count, push.capacity)) return;
  uint path = queue.ids[slot];
  rayQueryEXT query;
  run_query(query, RayRef(push.rays).items[path], gl_RayFlagsTerminateOnFirstHitEXT);
  bool occluded = rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT;
  OccludedRef(push.hits).items[path] = occluded ? 1u : 0u;
}
