// SPDX-License-Identifier: Apache-2.0
// A shadow ray at the next surface that may let light through: attenuates what it carries and sends it on, or, when no
// such surface is left, tells that it arrived.
// variant shadow_surface_procedural: HW_VM_PROCEDURAL
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/geometry.glsl"
#include "lib/material_vm.glsl"
#include "lib/surface_inputs.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint shadow = queued(gl_GlobalInvocationID.x);
  ShadowState s = ShadowArray(HW_FRAME.shadows).at[shadow];
  Hit hit = HitArray(HW_FRAME.shadow_surface_hits).at[shadow];
  if (hit.instance == HW_NONE) {
    UintBuffer(HW_FRAME.shadow_hits).at[shadow] = 0u;
    return;
  }
  if (s.transparent >= HW_FRAME.max_transparent) return;  // the limit reached, the surface counts as opaque
  Ray ray = RayArray(HW_FRAME.shadow_rays).at[shadow];
  SurfaceGeometry g = surface_geometry(hit, true);
  bool backfacing = dot(g.Ng, ray.direction) > 0.0;
  PathState state = PathArray(HW_FRAME.paths).at[path_of_shadow(shadow)];
  MaterialInputs inputs = surface_inputs(hit, g, -ray.direction, HW_PATH_SHADOW, state.bounces, s.transparent);
  vec3 through = material_transparency(inputs);
  if (!(through.x + through.y + through.z > 0.0)) return;
  ShadowArray(HW_FRAME.shadows).at[shadow].radiance = s.radiance * through;
  ShadowArray(HW_FRAME.shadows).at[shadow].transparent = s.transparent + 1u;
  vec3 origin = offset_origin(g.P, backfacing ? g.Ng : -g.Ng);
  RayArray(HW_FRAME.shadow_rays).at[shadow].origin = origin;
  RayArray(HW_FRAME.shadow_rays).at[shadow].tmax = ray.tmax - distance(origin, ray.origin);
  queue_push(push.out_queue, shadow);
}
