// SPDX-License-Identifier: Apache-2.0
// What both ray query kernels share: their push constants and the candidate loop (GLSL_EXT_ray_query).
// The top-level structure comes by address; its last instance holds the lamps' boxes.
#extension GL_EXT_ray_query : require

#include "shared/rays.h"
#include "lib/lamp_intersect.h"

layout(buffer_reference, scalar) readonly buffer QueueRef { QueueHeader header; uint ids[]; };
layout(buffer_reference, scalar) readonly buffer RayRef { Ray items[]; };
layout(buffer_reference, scalar) readonly buffer LampRef { LampShape items[]; };

layout(push_constant, scalar) uniform Push {
  uint64_t structure;  // address of the top-level acceleration structure
  uint64_t lamps;      // LampShape[]
  uint64_t queue;
  uint64_t rays;
  uint64_t hits;
  uint capacity;
} push;

// Triangles are opaque and commit themselves; what is left as candidates is lamps' boxes.
void run_query(rayQueryEXT query, Ray ray, uint flags) {
  if (!ray_is_traceable(ray)) {
    ray.origin = vec3(0.0);
    ray.direction = vec3(0.0, 0.0, 1.0);
    ray.tmin = ray.tmax = 0.0;
    ray.mask = 0u;
  }
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
