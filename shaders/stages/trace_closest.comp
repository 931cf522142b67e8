// SPDX-License-Identifier: Apache-2.0
// Nearest hit of every queued ray, by ray query.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_query.glsl"

layout(local_size_x = 64) in;

void main() {
  uint path;
  Ray ray;
  if (!queued_ray(gl_GlobalInvocationID.x, path, ray)) return;
  rayQueryEXT query;
  run_query(query, ray, gl_RayFlagsNoneEXT);
  Hit hit = no_hit(ray.tmax);
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
