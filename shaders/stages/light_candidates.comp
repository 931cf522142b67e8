// SPDX-License-Identifier: Apache-2.0
// The canonical light sample of every surface: resampled importance sampling (Talbot 2005) over lights drawn by the
// light table's odds, stratified over the table, streamed through a reservoir (Bitterli et al. 2020, algorithm 3); then
// a point on the light that was chosen, drawn as `path` draws it.
// out_queue: paths whose sample is to be tested for visibility before it is stored; 0: none are.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/reuse.glsl"
#include "lib/light_point.h"
#include "lib/sampler.h"
#include "lib/shadow_ray.glsl"
layout(local_size_x = 64) in;

Reservoir choose_light(TargetSurface target, PathState state, uint count) {
  uint random = random_stream(state.seed, HW_REUSE.pass, path_bounce(state.bounces) + state.transparent,
                              HW_STREAM_CANDIDATES, HW_FRAME.seed);
  float scale = float(HW_ROOT.light_count) / float(count);
  ReservoirStream stream = stream_begin();
  for (uint i = 0u; i < count; ++i) {
    float scaled = (float(i) + random_next(random)) * scale;
    uint entry = min(uint(scaled), HW_ROOT.light_count - 1u);
    uint64_t odds = proxy_words(entry).at[5];  // threshold, alias
    uint light = scaled - float(entry) < word_low_float(odds) ? entry : word_high(odds);
    LightProxy proxy = proxy_load(light);
    float p_hat = target_value(target, proxy, HW_REUSE.light_mis_scale);
    stream_add(stream, light, 0.0, 0.0, p_hat * proxy.inverse_choice, p_hat, 1.0, random_next(random));
  }
  return stream_end_count(stream);
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  PathState state = path_load(path);
  SurfacePoint point = surface_load(path);
  uint bounce = path_bounce(state.bounces);
  bool primary = bounce == 0u && (state.flags & HW_PATH_REUSED) == 0u;
  if ((point.flags & HW_SURFACE_DELTA_ONLY) != 0u) {
    reservoir_store(HW_REUSE.reservoirs, path, reservoir_empty(0.0));
    reuse_surface_store(HW_REUSE.targets, path, reuse_surface_none());
    return;
  }
  ClosureList list = closures_at(HW_FRAME.closures + uint64_t(path) * uint64_t(HW_MAX_CLOSURES * HW_CLOSURE_BYTES), point.closure_count);
  uint key = InstanceTable(HW_ROOT.instances).at[HitArray(HW_FRAME.hits).at[path].instance].key;
  vec3 wo = -ray_load(path).direction;
  ReuseSurface surface = reuse_surface(list, point.position, wo, point.shading_normal, key);
  Reservoir r = choose_light(target_surface(surface), state, primary ? HW_REUSE.candidates : HW_REUSE.indirect_candidates);

  // A point on it. Its density in the light's normalised measure: solid-angle pdf times solid angle per measure.
  vec2 u2 = sampler_2d(state.seed, state.sample_index, sampler_dimension(bounce + state.transparent, HW_DIM_LIGHT), HW_FRAME.seed);
  LightRecord light = light_load(min(r.light, HW_ROOT.light_count - 1u));
  LightSample s = light_sample_none();
  vec2 uv;
  float share = light_uniform_share(light);
  bool uniform_point = u2.x < share;
  u2.x = uniform_point ? u2.x / max(share, 1e-6) : min((u2.x - share) / max(1.0 - share, 1e-6), 0.99999994);
  bool sampled;
  if (light.type == HW_LIGHT_WORLD) {
    world_sample(HW_ROOT.world, u2, s.wi, s.pdf);
    sampled = s.pdf > 0.0;
    uv = light_world_uv(s.wi);
  } else {
    sampled = light_sample(light, HW_ROOT.emission_maps, point.position, vec3(u2, 0.0), s) || uniform_point;
    uv = uniform_point ? light_point_uniform(light, u2) : light_point_uv(light, point.position, s);
  }
  LightPoint p = light_point(light, uv, point.position);
  float pdf = s.pdf;
  if (uniform_point) pdf = light_pdf(light, HW_ROOT.emission_maps, point.position, p.wi, p.distance, uv);
  // A true point is always found, whatever it sends here: others may see more of it.
  float density = p.delta ? 1.0 : (1.0 - share) * pdf * p.density + share;
  bool ok = (sampled || p.delta) && density > 0.0 && r.light != HW_NONE;
  r.u = uv.x;
  r.v = uv.y;
  r.weight = r.weight / density;
  r.target *= reuse_point_brightness(light.emission_map, uv);
  if (!ok || !reservoir_usable(r.weight)) r = reservoir_empty(r.confidence);
  reservoir_store(HW_REUSE.reservoirs, path, r);
  reuse_surface_store(HW_REUSE.targets, path, surface);

  bool shadowed = light.type == HW_LIGHT_WORLD || (light.flags & HW_LIGHT_CAST_SHADOW) != 0u;
  if (push.out_queue != 0ul && primary && r.light != HW_NONE && shadowed) {
    shadow_ray_store(path, shadow_ray(point, p.wi, p.distance, p.normal));
    queue_push(push.out_queue, path);
  }
}
