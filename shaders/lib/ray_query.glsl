// SPDX-License-Identifier: Apache-2.0
// The candidate loop that both ray query kernels share (GLSL_EXT_ray_query). The top-level structure comes by address;
// its last instance holds the lamps' boxes.
#extension GL_EXT_ray_query : require

#include "lib/trace_io.glsl"

// Triangles are opaque and commit themselves; what is left as candidates is lamps' boxes.
void run_query(rayQueryEXT query, Ray ray, uint flags) {
  rayQueryInitializeEXT(query, accelerationStructureEXT(push.structure), gl_RayFlagsOpaqueEXT | flags, ray.mask, ray.origin,
                        ray.tmin, ray.direction, ray.tmax);
  while (rayQueryProceedEXT(query)) {
    if (rayQueryGetIntersectionTypeEXT(query, false) == gl_RayQueryCandidateIntersectionAABBEXT) {
      LampShape lamp = LampRef(push.lamps).items[rayQueryGetIntersectionPrimitiveIndexEXT(query, false)];
      float limit = ray.tmax;
      if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT)
        limit = rayQueryGetIntersectionTEXT(query, true);
      float t;
      if (lamp_intersect(lamp, ray.origin, ray.direction, ray.tmin, limit, t)) rayQueryGenerateIntersectionEXT(query, t);
    }
  }
}
