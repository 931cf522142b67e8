// SPDX-License-Identifier: Apache-2.0
// Rays that met no surface. Nothing at all: the world and the suns. A lamp: its emission, and the ray goes on behind it.
// Emission found by BSDF rays is weighted against next-event estimation (Veach and Guibas 1995).
// variant escaped_programs: HW_WITH_PROGRAMS HW_VM_PROCEDURAL
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/background.glsl"
#include "lib/camera.h"
#include "lib/found_light.glsl"
#include "lib/light_choice.glsl"
#include "lib/light_sampling.h"
#include "lib/wave.glsl"
#include "lib/world_sampling.h"
layout(local_size_x = 64) in;

// out_queue2: paths whose ray goes on.

void missed(uint path, PathState state, vec3 direction) {
  uint bit = light_visibility_bit(state.flags);
  bool film_background = (state.flags & HW_PATH_BACKGROUND_VISIBLE) != 0u;
  bool cut_out = film_background && (HW_FRAME.transparent_film & 1u) != 0u;

  vec3 world = vec3(0.0);
  float weight = 1.0;
  if ((HW_ROOT.world_flags & bit) != 0u) {
    world = background_radiance(direction, state.flags, state.bounces, state.transparent);
    bool mis = state.mis_pdf > 0.0 && (HW_ROOT.world_flags & HW_LIGHT_USE_MIS) != 0u;
    float choice = mis && HW_ROOT.world_light != HW_NONE ? light_choice_pdf(HW_ROOT.world_light, state) : 0.0;
    if (choice > 0.0) weight = mis_power(state.mis_pdf, HW_FRAME.reuse.light_mis_scale * choice * world_pdf(HW_ROOT.world, direction));
  }
  if (pass_on(HW_PASS_ENVIRONMENT) && path_bounce(state.bounces) == 0u)
    result_add3(path, HW_PASS_ENVIRONMENT, state.throughput * world);
  if (cut_out) {
    float through = (state.throughput.x + state.throughput.y + state.throughput.z) * (1.0 / 3.0);
    result_add1_at(path, HW_PASS_COMBINED, 3u, -through);
  } else {
    found_light(path, state, world, weight);
  }

  uint suns = HW_LIT_BY(HW_KIND_SUN) ? HW_ROOT.sun_count : 0u;
  for (uint i = 0u; i < suns; ++i) {
    uint index = HW_ROOT.sun_offset + i;
    LightRecord sun = light_load(index);
    float pdf;
    vec3 radiance = sun_emission(sun, direction, pdf);
    bool mis = state.mis_pdf > 0.0 && (sun.flags & HW_LIGHT_USE_MIS) != 0u;
    float w = 1.0;
    if (mis && pdf > 0.0) w = mis_power(state.mis_pdf, HW_FRAME.reuse.light_mis_scale * pdf * light_choice_pdf(index, state));
    // Without MIS a sun is next-event estimation's alone, but for paths that could not sample it.
    bool counts = (sun.flags & bit) != 0u && ((sun.flags & HW_LIGHT_USE_MIS) != 0u || state.mis_pdf <= 0.0);
    if (pdf > 0.0 && counts && !cut_out) found_light(path, state, radiance, w);
  }
}

void met_lamp(uint path, PathState state, Ray ray, Hit hit) {
  uint index = hit.primitive;
  LightRecord lamp = light_load(index);
  vec3 from = state.mis_origin;
  float t = dot(ray.origin - from, ray.direction) + hit.t;
  float pdf;
  bool visible;
  vec3 radiance = lamp_emission(lamp, from, ray.direction, t, pdf, visible);
  bool mis = state.mis_pdf > 0.0;
  // A sphere is met twice by a ray that goes through it; it shines once.
  bool sphere = lamp.type <= HW_LIGHT_SPOT && !lamp_sphere_is_disk(lamp);
  vec3 out_of_center = ray.origin + ray.direction * hit.t - lamp.position;
  bool from_inside = distance(from, lamp.position) < lamp.size_x;
  if (sphere && !from_inside && dot(out_of_center, ray.direction) > 0.0) visible = false;
  bool counts = visible && (lamp.flags & light_visibility_bit(state.flags)) != 0u &&
                ((lamp.flags & HW_LIGHT_USE_MIS) != 0u || !mis);
  float w = 1.0;
  if (mis && counts) w = mis_power(state.mis_pdf, HW_FRAME.reuse.light_mis_scale * pdf * light_choice_pdf(index, state));
  if (counts) found_light(path, state, radiance, w);
  // Lamps hide nothing: the ray goes on just behind the point, one transparent bounce poorer.
  ray.tmin = hit.t * (1.0 + 1e-5) + 1e-6;
  RayArray(HW_FRAME.rays).at[path].tmin = ray.tmin;
  PathArray(HW_FRAME.paths).at[path].transparent = state.transparent + 1u;
  if (ray.tmin < ray.tmax && state.transparent < HW_FRAME.max_transparent) queue_push(push.out_queue2, path);
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  PathState state = path_load(path);
  Ray ray = ray_load(path);
  Hit hit = hit_load(path);
  if (hit.instance == HW_NONE) {
    missed(path, state, ray.direction);
  } else {
    met_lamp(path, state, ray, hit);
  }
}
