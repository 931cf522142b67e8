// SPDX-License-Identifier: Apache-2.0
// What every shader that traces reads and writes: the queue, the rays, the hits, and the lamps' shapes.
#ifndef HW_TRACE_IO_GLSL
#define HW_TRACE_IO_GLSL

#include "shared/rays.h"
#include "lib/lamp_intersect.h"

layout(buffer_reference, scalar) readonly buffer QueueRef { QueueHeader header; uint ids[]; };
layout(buffer_reference, scalar) readonly buffer RayRef { Ray items[]; };
layout(buffer_reference, scalar) readonly buffer LampRef { LampShape items[]; };
layout(buffer_reference, scalar) writeonly buffer HitRef { Hit items[]; };
layout(buffer_reference, scalar) writeonly buffer OccludedRef { uint items[]; };

layout(push_constant, scalar) uniform Push {
  uint64_t structure;  // address of the top-level acceleration structure
  uint64_t lamps;      // LampShape[]
  uint64_t queue;
  uint64_t rays;
  uint64_t hits;
  uint capacity;
} push;

// The queued ray of a slot of the launch, which may have more slots than the queue has rays. False: none.
bool queued_ray(uint slot, out uint path, out Ray ray) {
  QueueRef queue = QueueRef(push.queue);
  if (slot >= min(queue.header.count, push.capacity)) return false;
  path = queue.ids[slot];
  ray = RayRef(push.rays).items[path];
  if (!ray_is_traceable(ray)) {  // a ray that hits nothing
    ray.origin = vec3(0.0);
    ray.direction = vec3(0.0, 0.0, 1.0);
    ray.tmin = ray.tmax = 0.0;
    ray.mask = 0u;
  }
  return true;
}

Hit no_hit(float tmax) {
  Hit hit;
  hit.t = tmax;
  hit.u = 0.0f;
  hit.v = 0.0f;
  hit.instance = HW_NONE;
  hit.primitive = HW_NONE;
  hit.pad = 0u;
  return hit;
}

#endif
