// SPDX-License-Identifier: Apache-2.0
// Brings in the emission of light samples that a material program decides: textured triangle lights, the world. A stage of
// its own, so that shade.comp stays small and programs run for these samples only.
#version 460
#extension GL_GOOGLE_include_directive : require
#define HW_WITH_PROGRAMS
#define HW_VM_PROCEDURAL
#include "lib/background.glsl"
#include "lib/triangle_emission.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint shadow = queued(gl_GlobalInvocationID.x);
  ShadowState s = ShadowArray(HW_FRAME.shadows).at[shadow];
  Ray ray = RayArray(HW_FRAME.shadow_rays).at[shadow];
  // As Cycles evaluates emission for light samples: by the shadow ray, with the depth of the path that casts it.
  uint bounces = s.bounce - 1u;
  LightRecord light = light_load(s.light);
  vec3 radiance = vec3(0.0);
  if (light.type == HW_LIGHT_WORLD) {
    radiance = background_radiance(ray.direction, HW_PATH_SHADOW, bounces, 0u);
  } else {
    Hit hit = triangle_light_hit(light, s.uv, ray.tmax);
    radiance = triangle_emission(light, hit, surface_geometry(hit, true), -ray.direction, bounces, 0u);
  }
  radiance *= s.radiance;
  ShadowArray(HW_FRAME.shadows).at[shadow].radiance = radiance;
  // Nothing to carry: the ray need not look for anything.
  if (!(radiance.x + radiance.y + radiance.z > 0.0)) RayArray(HW_FRAME.shadow_rays).at[shadow].mask = 0u;
}
