// SPDX-License-Identifier: Apache-2.0
// Lamps as Embree user geometry.

#include "trace/embree_lamps.h"

#include "lib/lamp_intersect.h"
#include "shared/rays.h"

namespace hw {
namespace {

void bounds_of(const RTCBoundsFunctionArguments* args) {
  const LampShape& lamp = static_cast<const LampShape*>(args->geometryUserPtr)[args->primID];
  const vec3 half = lamp_half_extent(lamp);
  RTCBounds& box = *args->bounds_o;
  box.lower_x = lamp.center.x - half.x;
  box.lower_y = lamp.center.y - half.y;
  box.lower_z = lamp.center.z - half.z;
  box.upper_x = lamp.center.x + half.x;
  box.upper_y = lamp.center.y + half.y;
  box.upper_z = lamp.center.z + half.z;
  if (lamp.shape == HW_LAMP_SHAPE_NONE) {  // an empty box: Embree leaves the primitive out
    box.lower_x = box.lower_y = box.lower_z = HW_INFINITY;
    box.upper_x = box.upper_y = box.upper_z = -HW_INFINITY;
  }
}

bool hit(const void* lamps, unsigned primitive, const RTCRay& ray, float& t) {
  if (!(ray.mask & HW_MASK_LAMP)) return false;
  const LampShape& lamp = static_cast<const LampShape*>(lamps)[primitive];
  return lamp_intersect(lamp, vec3(ray.org_x, ray.org_y, ray.org_z), vec3(ray.dir_x, ray.dir_y, ray.dir_z), ray.tnear,
                        ray.tfar, t);
}

// Called for one ray at a time: the tracer sends no packets here.
void closest(const RTCIntersectFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto& rayhit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
  float t;
  if (!hit(args->geometryUserPtr, args->primID, rayhit.ray, t)) return;
  rayhit.ray.tfar = t;
  rayhit.hit.geomID = args->geomID;
  rayhit.hit.primID = args->primID;
}

void any(const RTCOccludedFunctionNArguments* args) {
  if (!args->valid[0]) return;
  auto& ray = *reinterpret_cast<RTCRay*>(args->ray);
  float t;
  if (hit(args->geometryUserPtr, args->primID, ray, t)) ray.tfar = -HW_INFINITY;
}

}  // namespace

void attach_lamps(RTCDevice device, RTCScene scene, const std::vector<LampShape>& lamps) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(lamps.size()));
  rtcSetGeometryUserData(geometry, const_cast<LampShape*>(lamps.data()));
  rtcSetGeometryBoundsFunction(geometry, bounds_of, nullptr);
  rtcSetGeometryIntersectFunction(geometry, closest);
  rtcSetGeometryOccludedFunction(geometry, any);
  rtcSetGeometryMask(geometry, HW_MASK_LAMP);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, 0);
  rtcReleaseGeometry(geometry);
}

}  // namespace hw
