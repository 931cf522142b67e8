// SPDX-License-Identifier: Apache-2.0
// The canonical light sample of every surface: resampled importance sampling (Talbot 2005) over candidates drawn by the
// light table's odds, stratified over the table, streamed through a reservoir (Bitterli et al. 2020, algorithm 3).
// out_queue: paths whose sample is to be tested for visibility before it is stored; 0: none are.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/reuse.glsl"
#include "lib/sampler.h"
#include "lib/shadow_ray.glsl"
layout(local_size_x = 64) in;

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queue.path[gl_GlobalInvocationID.x];
  PathState state = PathArray(HW_FRAME.paths).at[path];
  SurfacePoint point = SurfaceArray(HW_FRAME.surfaces).at[path];
  bool primary = path_bounce(state.bounces) == 0u && (state.flags & HW_PATH_REUSED) == 0u;

  Reservoir canonical = reservoir_empty(0.0);
  ReuseSurface surface = reuse_surface_none();
  if ((point.flags & HW_SURFACE_DELTA_ONLY) == 0u && HW_ROOT.light_count > 0u) {
    ClosureList list = closures_at(HW_FRAME.closures + uint64_t(path) * uint64_t(HW_MAX_CLOSURES * 64u), point.closure_count);
    uint key = InstanceTable(HW_ROOT.instances).at[HitArray(HW_FRAME.hits).at[path].instance].random_id;
    vec3 wo = -RayArray(HW_FRAME.rays).at[path].direction;
    surface = reuse_surface(list, point.position, wo, point.shading_normal, min(key, HW_NONE - 1u));
    TargetSurface target = target_surface(surface);

    uint count = primary ? HW_REUSE.candidates : HW_REUSE.indirect_candidates;
    uint random = random_stream(state.seed, state.sample_index, path_bounce(state.bounces) + state.transparent,
                                HW_STREAM_CANDIDATES, HW_FRAME.seed);
    ReservoirStream stream = stream_begin();
    for (uint i = 0u; i < count; ++i) {
      float u = (float(i) + random_next(random)) / float(count);
      float u1 = random_next(random);
      float u2 = random_next(random);
      uint index = alias_pick(HW_ROOT.light_alias, HW_ROOT.light_count, min(u, 0.99999994));
      float choice = AliasTable(HW_ROOT.light_alias).at[index].pdf;
      LightRecord light = LightTable(HW_ROOT.lights).at[index];
      float pdf;
      vec2 uv = light_point_sample(light, HW_ROOT.world, point.position, vec2(u1, u2), pdf);
      LightPoint p = light_point(light, HW_ROOT.world, uv, point.position);
      uint flags = light.type == HW_LIGHT_WORLD ? HW_ROOT.world_flags : light.flags;
      float p_hat = target_value(target, p, flags, choice, HW_REUSE.light_mis_scale);
      float source = choice * pdf;
      stream_add(stream, index, uv.x, uv.y, source > 0.0 ? p_hat / source : 0.0, p_hat, 1.0, random_next(random));
    }
    canonical = stream_end_count(stream);
  }
  ReservoirArray(HW_REUSE.reservoirs).at[path] = canonical;
  ReuseSurfaceArray(HW_REUSE.targets).at[path] = surface;

  if (push.out_queue != 0ul && primary && canonical.light != HW_NONE) {
    LightRecord light = LightTable(HW_ROOT.lights).at[canonical.light];
    LightPoint p = light_point(light, HW_ROOT.world, vec2(canonical.u, canonical.v), point.position);
    if (light.type == HW_LIGHT_WORLD || (light.flags & HW_LIGHT_CAST_SHADOW) != 0u) {
      RayArray(HW_FRAME.shadow_rays).at[path] = shadow_ray(point, p.wi, p.distance, p.normal);
      queue_push(push.out_queue, path);
    }
  }
}
