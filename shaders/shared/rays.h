// SPDX-License-Identifier: Apache-2.0
// Rays, hits and queues: what stages and Tracers exchange. Arrays are indexed by path id; queues list path ids.
#ifndef HW_RAYS_H
#define HW_RAYS_H
#include "portable.h"
HW_NAMESPACE_BEGIN

// World space; direction of unit length; [tmin, tmax] in metres. `mask` is tested against the instance's mask.
struct Ray {
  vec3 origin;
  float tmin;
  vec3 direction;
  float tmax;
  uint mask;
  uint flags;  // HW_RAY_*
};
HW_CONST uint HW_RAY_BYTES = 40u;
HW_CHECK_SIZE(Ray, HW_RAY_BYTES)

// What a Tracer may make use of, or not. The ray ends its path at whatever surface it meets: where that is, and which,
// does not matter, and HW_BLOCKED_INSTANCE may be answered. It only looks for lamps, and with HW_RAY_MISS_DARK nothing
// shines behind everything either: a ray that meets no lamp may be answered so too.
HW_CONST uint HW_RAY_SURFACES_DARK = 1u;
HW_CONST uint HW_RAY_MISS_DARK = 2u;

// Whether a Tracer may be given the ray. Embree 3 ends the process over numbers that are not finite or very large, and
// ray query leaves them undefined; what is not traceable hits nothing. (1e18: below Embree's own bound of 1.844e18.)
HW_FN bool ray_is_traceable(HW_IN(Ray) r) {
  float limit = 1e18f;
  bool o = abs(r.origin.x) <= limit && abs(r.origin.y) <= limit && abs(r.origin.z) <= limit;
  bool d = abs(r.direction.x) <= limit && abs(r.direction.y) <= limit && abs(r.direction.z) <= limit;
  return o && d && r.tmin >= 0.0f && r.tmax >= r.tmin;
}

// The nearest hit. instance == HW_NONE: nothing hit. instance == HW_LAMP_INSTANCE: `primitive` is a lamp index.
// Triangle barycentrics as Vulkan and Embree have them: P = (1-u-v) v0 + u v1 + v v2.
struct Hit {
  float t;
  float u;
  float v;
  uint instance;   // index into the instance table
  uint primitive;  // triangle index within the mesh
  uint pad;        // records are whole 64-bit words: lib/words.glsl
};
HW_CONST uint HW_HIT_BYTES = 24u;
HW_CHECK_SIZE(Hit, HW_HIT_BYTES)

HW_CONST uint HW_LAMP_INSTANCE = 0xFFFFFFFEu;
HW_CONST uint HW_BLOCKED_INSTANCE = 0xFFFFFFFDu;  // see HW_RAY_SURFACES_DARK

// Instance mask bits (Vulkan has eight). Ray visibility is as in Cycles: what kind of ray may see the object.
HW_CONST uint HW_MASK_CAMERA = 1u;
HW_CONST uint HW_MASK_DIFFUSE = 2u;
HW_CONST uint HW_MASK_GLOSSY = 4u;
HW_CONST uint HW_MASK_TRANSMISSION = 8u;
HW_CONST uint HW_MASK_SHADOW_OPAQUE = 16u;       // blocks shadow rays
HW_CONST uint HW_MASK_SHADOW_TRANSPARENT = 32u;  // shadow rays pass, attenuated by the material
HW_CONST uint HW_MASK_LAMP = 64u;                // lamps, for rays that carry MIS against next-event estimation
HW_CONST uint HW_MASK_VOLUME = 128u;             // reserved

// Header of a queue buffer. The first three words are a VkDispatchIndirectCommand for workgroups of HW_GROUP_SIZE, the
// last three a VkTraceRaysIndirectCommandKHR of one ray each. `count` path ids follow.
struct QueueHeader {
  uint groups_x;
  uint groups_y;
  uint groups_z;
  uint count;
  uint launch_height;
  uint launch_depth;
};
HW_CONST uint HW_QUEUE_HEADER_BYTES = 24u;
HW_CHECK_SIZE(QueueHeader, HW_QUEUE_HEADER_BYTES)
HW_CONST uint HW_GROUP_SIZE = 64u;

HW_NAMESPACE_END
#endif
