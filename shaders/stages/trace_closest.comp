// SPDX-License-Identifier: Apache-2.0
// Nearest hit of every queued ray, by ray query.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_query.glsl"

layout(local_size_x = 64) in;
layout(buffer_reference, scalar) writeonly buffer HitRef { Hit items[]; };

void main() {
  uint slot = gl_GlobalInvocationID.x;
  QueueRef queue = QueueRef(push.queue);
  if (slot >= min(queue.header.count, push.capacity)) return;
  uint path = queue.ids[slot];
  Ray ray = RayRef(push.rays).items[path];
  rayQueryEXT query;
  run_query(query, ray, gl_RayFlagsNoneEXT);
  Hit hit;
  hit.t = ray.tmax;
  hit.u = 0.0f;
  hit.v = 0.0f;
  hit.instance = HW_NONE;
  hit.primitive = HW_NONE;
  uint type = rayQueryGetIntersectionTypeEXT(query, true);
  if (type != gl_RayQueryCommittedIntersectionNoneEXT) {
    hit.t = rayQueryGetIntersectionTEXT(query, true);
    hit.primitive = rayQueryGetIntersectionPrimitiveIndexEXT(query, true);
    hit.instance = HW_LAMP_INSTANCE;
    if (type == gl_RayQueryCommittedIntersectionTriangleEXT) {
      vec2 uv = rayQueryGetIntersectionBarycentricsEXT(query, true);
      hit.u = uv.x;
      hit.v = uv.y;
      hit.instance = rayQueryGetIntersectionInstanceIdEXT(query, true);
    }
  }
  HitRef(push.hits).items[path] = hit;
}
