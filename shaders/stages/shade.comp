// SPDX-License-Identifier: Apache-2.0
// At a surface: its light samples, each with its shadow ray (next-event estimation), and one BSDF sample with the next
// ray. shade_reservoir takes the light sample from the path's reservoir instead of drawing one, shade_cells draws lights
// by the surface's cell.
// variant shade_reservoir: HW_RESERVOIR
// variant shade_cells: HW_CELLS_DRAW
// a: light samples of each surface; b: paths that go on from the first surface that scatters light.
#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef HW_CELLS_DRAW
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_atomic_int64 : require
#endif
#define HW_CLOSURES_KEPT
#include "lib/wave.glsl"
#include "lib/closures.h"
#ifdef HW_CELLS_DRAW
#include "lib/light_cell_draw.glsl"
#endif
#include "lib/light_choice.glsl"
#include "lib/light_sampling.h"
#include "lib/path_reuse.glsl"
#include "lib/sampler.h"
#include "lib/shadow_ray.glsl"
#include "lib/world_sampling.h"
layout(local_size_x = 64) in;

// out_queue: shadow rays; out_queue2: paths with a next ray.

// What path reuse does here: nothing, or the surface is its pixel's anchor, or a shared vertex.
const uint HW_REUSE_NOT = 0u, HW_REUSE_ANCHOR = 1u, HW_REUSE_VERTEX = 2u;

// Light sample `number` of `samples`. False: it brings nothing, whatever its shadow ray would say.
bool sample_light(uint path, PathState state, SurfacePoint point, ShadingGeometry sg, ClosureList list, uint dimension_bounce,
                  uint samples, uint number, uint ways, uint reuse) {
  ShadowState shadow;
  shadow.slot = 0u;
  shadow.teaches = 0.0;
#ifdef HW_RESERVOIR
  Reservoir r = ReservoirArray(HW_FRAME.reuse.reservoirs).at[path];
  LightDraw draw = draw_reservoir(point.position, r, HW_FRAME.reuse.light_mis_scale);
#else
  uint index = state.sample_index * samples + number;
  vec3 u3 = sampler_3d(state.seed, index, sampler_dimension(dimension_bounce, HW_DIM_LIGHT), HW_FRAME.seed);
  float u = u3.x;
  vec2 u2 = u3.yz;
#ifdef HW_CELLS_DRAW
  float choice;
  uint light = light_cell_draw(u, choice, shadow.slot);
  LightDraw draw = draw_on_light(point.position, light, choice > 0.0 ? 1.0 / choice : 0.0, choice, u2);
  shadow.teaches = light_cell_teaches;
#else
  LightDraw draw = draw_light(point.position, octahedral_unpack(point.receiver),
                              (point.receiver & HW_RECEIVER_TRANSMITS) != 0u, u, u2);
#endif
#endif
  if (!draw.valid) return false;

  BsdfValue bsdf = closures_eval(list, sg, draw.wi);
  // What the light is told not to shine on.
  vec3 diffuse = (draw.flags & HW_LIGHT_DIFFUSE) != 0u ? bsdf.diffuse : vec3(0.0);
  vec3 glossy = (draw.flags & HW_LIGHT_GLOSSY) != 0u ? bsdf.glossy : vec3(0.0);
  vec3 transmission = (draw.flags & HW_LIGHT_TRANSMISSION) != 0u ? bsdf.transmission : vec3(0.0);
  vec3 f = diffuse + glossy + transmission;
  float weight = (draw.flags & HW_LIGHT_USE_MIS) != 0u && !draw.delta ? mis_power(float(samples) * draw.mis_pdf, float(ways) * bsdf.pdf) : 1.0;
  vec3 radiance = state.throughput * f * draw.radiance * (weight / (draw.pdf * float(samples)));
  if (!(radiance.x + radiance.y + radiance.z > 0.0)) return false;

  shadow.radiance = radiance;
  shadow.bounce = (path_bounce(state.bounces) + 1u) | ((state.flags & HW_PATH_SPLIT) != 0u ? HW_SHADOW_SPLIT : 0u);
  if (HW_PATH_REUSE) {
    bool here = reuse == HW_REUSE_VERTEX;
    if (here) {
      vec3 even = (draw.flags & HW_LIGHT_DIFFUSE) != 0u ? bsdf.even : vec3(0.0);
      SharedVertexArray(HW_FRAME.shared_vertices).at[path].light_share = shares_of(even, f);
    }
    if ((state.flags & HW_PATH_SHARED) != 0u) shadow.bounce |= HW_SHADOW_SHARED | (here ? HW_SHADOW_SHARED_HERE : 0u);
  }
  shadow.diffuse = vec3(0.0);
  shadow.glossy = vec3(0.0);
  shadow.light = draw.light;
  shadow.uv = draw.uv;
  shadow.transparent = 0u;
  if (HW_LIGHT_PASSES) {
    shadow.diffuse = shares_of(diffuse, f);
    shadow.glossy = shares_of(glossy, f);
    if (path_bounce(state.bounces) > 0u) {
      PathSplit split = SplitArray(HW_FRAME.splits).at[path];
      shadow.diffuse = split.diffuse;
      shadow.glossy = split.glossy;
    }
  }
  uint ray = shadow_of(path, number);
  shadow_store(ray, shadow);
  if ((draw.flags & HW_LIGHT_CAST_SHADOW) == 0u) {
    UintBuffer(HW_FRAME.shadow_hits).at[ray] = 0u;
    return true;
  }
  shadow_ray_store(ray, shadow_ray(point, draw.wi, draw.distance, draw.normal));
  queue_push(push.out_queue, ray);
  if (draw.program) queue_push(HW_FRAME.program_queue, ray);
  return true;
}

// One of `ways` paths that go on from a surface by a BSDF sample. `places`: of the surface's path, where they are split,
// else 1; they take the last. `samples`: the surface's light samples.
void scatter(uint first, uint way, uint ways, uint places, PathState state, Ray ray, SurfacePoint point,
             ShadingGeometry sg, ClosureList list, uint samples, uint reuse) {
  uint path = first + places - ways + way;
  uint bounce = path_bounce(state.bounces);
  uint dimension_bounce = bounce + state.transparent;
  if (HW_PATH_REUSE) {
    if (reuse == HW_REUSE_ANCHOR) SharedVertexArray(HW_FRAME.shared_vertices).at[path].kind = HW_SHARED_NONE;
  }
  if (places > 1u) {
    state.sample_index = state.sample_index * ways + way;
    state.throughput *= 1.0 / float(ways);
    state.flags |= HW_PATH_SPLIT;
    if (HW_LIGHT_PASSES || HW_FEATURE_PASSES) {
      // Denoising features are the first one's.
      SplitArray(HW_FRAME.splits).at[path] = SplitArray(HW_FRAME.splits).at[first];
      if (way > 0u) state.flags |= HW_PATH_FEATURES_DONE;
    }
  }
  vec3 u3 = sampler_3d(state.seed, state.sample_index, sampler_dimension(dimension_bounce, HW_DIM_BSDF), HW_FRAME.seed);
  BsdfSample s = closures_sample(list, sg, u3);
  if (s.label == HW_LABEL_NONE || !(s.value.pdf > 0.0)) return;
  vec3 total = s.value.diffuse + s.value.glossy + s.value.transmission;
  vec3 throughput = state.throughput * (total / s.value.pdf);
  if (!(throughput.x + throughput.y + throughput.z > 0.0)) return;
  if (HW_PATH_REUSE) {
    if (reuse == HW_REUSE_VERTEX)
      SharedVertexArray(HW_FRAME.shared_vertices).at[path].share = shares_of(s.value.even, total);
  }

  bool transparent = (s.label & HW_LABEL_TRANSPARENT) != 0u;
  if (transparent) {
    // Straight on: the ray keeps its type and what it is weighed with.
    state.transparent += 1u;
    if (state.transparent > HW_FRAME.max_transparent) state.flags |= HW_PATH_NO_TRANSPARENT;
    ray.tmax -= distance(point.position, ray.origin);
  } else {
    bool reflects = (s.label & HW_LABEL_REFLECT) != 0u;
    bool diffuse = (s.label & HW_LABEL_DIFFUSE) != 0u;
    bool singular = (s.label & HW_LABEL_SINGULAR) != 0u;
    if (HW_LIGHT_PASSES) {
      if (bounce == 0u) {
        SplitArray(HW_FRAME.splits).at[path].diffuse = shares_of(s.value.diffuse, total);
        SplitArray(HW_FRAME.splits).at[path].glossy = shares_of(s.value.glossy, total);
      }
    }
    uint b = state.bounces;
    uint diffuse_bounces = ((b >> 8u) & 255u) + (reflects && diffuse ? 1u : 0u);
    uint glossy_bounces = ((b >> 16u) & 255u) + (reflects && !diffuse ? 1u : 0u);
    uint transmission_bounces = (b >> 24u) + (reflects ? 0u : 1u);
    bounce = min(bounce + 1u, 255u);
    state.bounces = bounce | min(diffuse_bounces, 255u) << 8u | min(glossy_bounces, 255u) << 16u |
                    min(transmission_bounces, 255u) << 24u;
    bool last = bounce > HW_FRAME.max_bounces || diffuse_bounces > HW_FRAME.max_diffuse ||
                glossy_bounces > HW_FRAME.max_glossy || transmission_bounces > HW_FRAME.max_transmission;
    if (last && (HW_FRAME.frame_flags & HW_FRAME_BSDF_HITS_EMIT) == 0u) return;

    bool keeps_background = (HW_FRAME.transparent_film & 2u) != 0u && !reflects &&
                            (state.flags & HW_PATH_BACKGROUND_VISIBLE) != 0u && s.roughness < 0.1;
    uint kept = state.flags & (HW_PATH_FIRST_DONE | HW_PATH_FEATURES_DONE | HW_PATH_NO_TRANSPARENT | HW_PATH_SPLIT | HW_PATH_SHARED);
    state.flags = kept | (reflects ? HW_PATH_REFLECTION : HW_PATH_TRANSMISSION) |
                  (diffuse ? HW_PATH_DIFFUSE : singular ? HW_PATH_GLOSSY | HW_PATH_SINGULAR : HW_PATH_GLOSSY) |
                  (last ? HW_PATH_EMISSION_ONLY : 0u) | (keeps_background ? HW_PATH_BACKGROUND_VISIBLE : 0u);
    if (HW_PATH_REUSE) {
      uint gives = diffuse ? HW_SURFACE_GIVES : HW_SURFACE_GIVES_GLOSSY;
      if (reuse == HW_REUSE_ANCHOR && reflects && !singular && (point.flags & gives) != 0u && !last) {
        state.flags |= HW_PATH_FRESH;
        SharedVertexArray(HW_FRAME.shared_vertices).at[path].arrival = throughput;
        SharedVertexArray(HW_FRAME.shared_vertices).at[path].glossy = diffuse ? 0u : 1u;
      }
    }
    // As many against as many light samples as this surface has had: MIS sees nothing but the ratio of the two.
    state.mis_pdf = singular ? 0.0 : s.value.pdf * (float(ways) / float(samples));
    state.mis_origin = point.position;
    state.mis_normal = point.receiver;
    state.mis_cell = HW_NONE;
#ifdef HW_CELLS_DRAW
    state.mis_cell = light_cell_here;
#endif
    if (!singular) state.min_pdf = min(state.min_pdf, s.value.pdf);
    ray.direction = s.wi;
    ray.tmax = HW_INFINITY;
    ray.mask = (reflects ? diffuse ? HW_MASK_DIFFUSE : HW_MASK_GLOSSY : HW_MASK_TRANSMISSION) | HW_MASK_LAMP;
    // Past the last bounce most scenes have nothing but lamps to find. What sort_hits.comp drops, a Tracer need not find.
    bool wants_surface = keeps_background || (HW_FEATURE_PASSES && (state.flags & HW_PATH_FEATURES_DONE) == 0u);
    if (last && !wants_surface && (HW_FRAME.frame_flags & HW_FRAME_SURFACES_DARK) != 0u)
      ray.flags = HW_RAY_SURFACES_DARK |
                  ((HW_FRAME.frame_flags & HW_FRAME_MISSES_DARK) != 0u ? HW_RAY_MISS_DARK : 0u);
  }
  ray.origin = offset_origin(point.position, dot(point.normal, ray.direction) < 0.0 ? -point.normal : point.normal);
  ray.tmin = 0.0;
  state.throughput = throughput;
  path_store(path, state);
  ray_store(path, ray);
  queue_push(push.out_queue2, path);
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  PathState state = path_load(path);
  SurfacePoint point = surface_load(path);
  Ray ray = ray_load(path);
  ShadingGeometry sg;
  sg.wo = -ray.direction;
  sg.Ng = point.normal;
  sg.Ns = point.shading_normal;
  sg.flags = point.flags & HW_SURFACE_SHADE_FLAGS;
  ClosureList list = closures_at(HW_FRAME.closures + uint64_t(path) * uint64_t(HW_MAX_CLOSURES * HW_CLOSURE_BYTES), point.closure_count);
  uint bounce = path_bounce(state.bounces);
  uint dimension_bounce = bounce + state.transparent;

  // Where light scatters first, several paths go on: what was found of the surface serves them all.
  bool whole = (point.flags & HW_SURFACE_WHOLE) != 0u;
  bool splits = HW_FRAME.places > 1u && (state.flags & HW_PATH_SPLIT) == 0u && !whole;
  uint ways = splits ? push.b : 1u;
  uint places = splits ? HW_FRAME.places : 1u;
  uint reuse = HW_REUSE_NOT;
  if (HW_PATH_REUSE) {
    if (splits && places > ways && (point.flags & (HW_SURFACE_GIVES | HW_SURFACE_GIVES_GLOSSY)) != 0u && bounce == 0u && state.transparent == 0u) {
      reuse = HW_REUSE_ANCHOR;
      PathArray(HW_FRAME.paths).at[path].flags = state.flags | HW_PATH_ANCHOR;
    }
    if ((state.flags & HW_PATH_FRESH) != 0u) {
      state.flags &= ~HW_PATH_FRESH;
      if (!whole && (point.flags & HW_SURFACE_UNEVEN) == 0u) {
        reuse = HW_REUSE_VERTEX;
        state.flags |= HW_PATH_SHARED;
        SharedVertexArray vertices = SharedVertexArray(HW_FRAME.shared_vertices);
        vertices.at[path].kind = HW_SHARED_MET;
        vertices.at[path].position = point.position;
        vertices.at[path].normal = octahedral_pack(point.normal);
        vertices.at[path].light = vec3(0.0);
      }
    }
  }
  uint samples = push.a;
  bool lit = (point.flags & HW_SURFACE_DELTA_ONLY) == 0u && HW_ROOT.light_count > 0u;
#ifdef HW_CELLS_DRAW
  light_cell_here = HW_NONE;
  if (lit) light_cell_enter(path, state, point, samples);
#endif
  for (uint number = 0u; number < samples; ++number) {
    bool asks = lit && sample_light(path, state, point, sg, list, dimension_bounce, samples, number, ways, reuse);
    if (!asks) UintBuffer(HW_FRAME.shadow_hits).at[shadow_of(path, number)] = 1u;
  }

  for (uint way = 0u; way < ways; ++way)
    scatter(path, way, ways, places, state, ray, point, sg, list, samples, reuse);
}
