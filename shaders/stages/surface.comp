// SPDX-License-Identifier: Apache-2.0
// A surface that a ray met: its program runs, its emission is taken (weighted against next-event estimation, Veach and
// Guibas 1995), its closures are left for the shade stage.
// variant surface_procedural: HW_VM_PROCEDURAL
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/found_light.glsl"
#include "lib/geometry.glsl"
#include "lib/light_choice.glsl"
#include "lib/light_sampling.h"
#include "lib/material_vm.glsl"
#include "lib/passes.glsl"
#include "lib/sampler.h"
#include "lib/surface_inputs.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

// out_queue: paths with closures to shade.

// Leaves the transparent closure alone, which is the last one where there is one. Returns how many closures are left.
uint keep_transparent(ClosureList list, uint count) {
  if (!HW_HAS(HW_FEATURE_TRANSPARENT) || count == 0u) return 0u;
  Closure last = closure_load(list, count - 1u);
  if (closure_type(last) != HW_CLOSURE_TRANSPARENT) return 0u;
  closure_store(list, 0u, last);
  return 1u;
}

void met_surface(uint path, PathState state, Ray ray, Hit hit) {
  SurfaceGeometry g = surface_geometry(hit, true);
  vec3 wo = -ray.direction;
  bool backfacing = dot(g.Ng, wo) < 0.0;
  vec3 Ng = backfacing ? -g.Ng : g.Ng;
  vec3 N = backfacing ? -g.N : g.N;
  bool first = (state.flags & HW_PATH_FIRST_DONE) == 0u;

  MaterialInputs inputs = surface_inputs(hit, g, wo, state.flags & HW_PATH_RAY_TYPES, state.bounces, state.transparent);
  CameraRecord camera = HW_ROOT.camera;
  float across = camera_width(camera) / float(HW_FRAME.width);
  inputs.footprint = camera.type == HW_CAMERA_ORTHOGRAPHIC ? across : across * distance(g.P, camera_position(camera));
  uint material_flags = word_high(word_at(HW_ROOT.materials + uint64_t(g.material) * HW_MATERIAL_BYTES, 1u));
  bool behind_diffuse = (state.flags & HW_PATH_DIFFUSE) != 0u;
  inputs.shade_flags = inputs.shade_flags |
                       ((material_flags & HW_MATERIAL_BUMP_CORRECTION) != 0u ? HW_SHADE_BUMP_CORRECTION : 0u) |
                       (behind_diffuse && (HW_FRAME.caustics & 1u) == 0u ? HW_SHADE_NO_REFLECTIVE_CAUSTICS : 0u) |
                       (behind_diffuse && (HW_FRAME.caustics & 2u) == 0u ? HW_SHADE_NO_REFRACTIVE_CAUSTICS : 0u);

  ShadingGeometry sg;
  sg.wo = wo;
  sg.Ng = Ng;
  sg.Ns = N;
  sg.flags = inputs.shade_flags;

  ShaderOutput surface;
  surface.closures = closures_at(HW_FRAME.closures + uint64_t(path) * uint64_t(HW_MAX_CLOSURES * HW_CLOSURE_BYTES), 0u);
  material_eval(inputs, surface);

  // A holdout cuts its opaque share out of the film; an object that is one shows nothing but what is behind it.
  bool film_background = (state.flags & HW_PATH_BACKGROUND_VISIBLE) != 0u;
  bool holdout = film_background && (g.instance_flags & HW_INSTANCE_HOLDOUT) != 0u;
  vec3 alpha = vec3(1.0) - surface.transparency;
  vec3 cut = holdout ? alpha : surface.holdout;
  if (film_background) {
    vec3 gone = state.throughput * cut;
    result_add1_at(path, HW_PASS_COMBINED, 3u, -(gone.x + gone.y + gone.z) * (1.0 / 3.0));
    if (cut == vec3(1.0)) return;
  }

  // Emission, weighed against having sampled this triangle from the last vertex.
  if (HW_LIT_BY(HW_KIND_EMISSION) && surface.emission.x + surface.emission.y + surface.emission.z > 0.0 && !holdout) {
    float weight = 1.0;
    if (HW_LIT_BY(HW_KIND_TRIANGLE) && state.mis_pdf > 0.0 && g.light_offset != HW_NONE) {
      uint light = g.light_offset + hit.primitive;
      LightRecord record = light_load(light);
      float pdf = triangle_light_pdf(record, HW_ROOT.emission_maps, state.mis_origin, ray.direction,
                                     distance(g.P, state.mis_origin), vec2(hit.u, hit.v)) *
                  light_choice_pdf(light, state);
      weight = mis_power(state.mis_pdf, HW_FRAME.reuse.light_mis_scale * pdf);
    }
    if (path_bounce(state.bounces) == 0u && pass_on(HW_PASS_EMISSION))
      result_add3(path, HW_PASS_EMISSION, state.throughput * surface.emission);
    found_light(path, state, surface.emission, weight);
  }

  uint count = surface.closures.count;
  if (holdout) count = keep_transparent(surface.closures, count);
  surface.closures.count = count;

  if (first && film_background) {
    float opaque = (alpha.x + alpha.y + alpha.z) * (1.0 / 3.0);
    if (opaque >= HW_FRAME.pass_alpha_threshold || HW_FRAME.pass_alpha_threshold <= 0.0) {
      write_surface_passes(path, state, hit, g, surface.closures, sg);
      state.flags |= HW_PATH_FIRST_DONE;
    }
  }
  if (film_background) write_share_passes(path, state, g, surface.closures, sg, alpha);

  if (HW_FEATURE_PASSES) {
    if ((state.flags & HW_PATH_FEATURES_DONE) == 0u) {
      if (write_denoising_features(path, surface.closures, sg, hit.t - ray.tmin)) state.flags |= HW_PATH_FEATURES_DONE;
    }
  }

  // Bounce limits. Past the last bounce only what goes straight through is left.
  if ((state.flags & HW_PATH_NO_TRANSPARENT) != 0u) return;
  if ((state.flags & HW_PATH_EMISSION_ONLY) != 0u) {
    count = keep_transparent(surface.closures, count);
  }
  if (count == 0u) return;

  // Russian roulette on the throughput, as Cycles does it (square root of the largest channel).
  if (path_bounce(state.bounces) > HW_FRAME.min_bounces) {
    float largest = max(abs(state.throughput.x), max(abs(state.throughput.y), abs(state.throughput.z)));
    if ((state.flags & HW_PATH_SPLIT) != 0u) largest *= float(HW_FRAME.bounce_samples);
    float survive = min(sqrt(largest), 1.0);
    float u = sampler_1d(state.seed, state.sample_index,
                         sampler_dimension(path_bounce(state.bounces) + state.transparent, HW_DIM_ROULETTE), HW_FRAME.seed);
    if (!(u < survive)) return;
    state.throughput /= survive;
  }

  // Filter Glossy: closures seen after a blurry bounce are blurred too.
  bool delta_only = true, straight = false;
  vec3 receiver = Ng;
  bool transmits = false;
  float blur = state.min_pdf * HW_FRAME.filter_glossy;
  bool blurs = blur < 1.0;
  float blur_roughness = sqrt(max(1.0 - blur, 0.0)) * 0.5;
  float sharp = 0.0, blurry = 0.0;
  vec3 reflected = vec3(0.0);
  bool bumped_reflection = false;
  for (uint i = 0u; i < count; ++i) {
    Closure c = closure_load(surface.closures, i);
    if (blurs) {
      closure_blur(c, blur_roughness);
      closure_store_roughness(surface.closures, i, c);
    }
    bool singular = closure_is_singular(c);
    if (HW_HAS(HW_FEATURE_LIGHT_TREE)) {
      // Light is evaluated about closures' own normals (lib/closures.h).
      bool other = HW_HAS(HW_FEATURE_BUMP) && !delta_only && dot(c.N, receiver) < 0.99999;
      transmits = transmits || (!singular && (other || closure_lets_through(c)));
      if (HW_HAS(HW_FEATURE_BUMP)) receiver = !singular && delta_only ? c.N : receiver;
    }
    if (HW_HAS(HW_FEATURE_LIGHT_CELLS)) {
      bool reflects = closure_is_microfacet(c) && closure_type(c) != HW_CLOSURE_REFRACTION && c.alpha_x * c.alpha_y < 0.09;
      sharp += !singular && reflects ? c.sample_weight : 0.0;
      blurry += singular || reflects ? 0.0 : c.sample_weight;
    }
    if (HW_PATH_REUSE) {
      reflected += closure_reflects_diffusely(c) ? c.weight : vec3(0.0);
      bumped_reflection = bumped_reflection || (!closure_is_diffuse(c) && (c.type & HW_CLOSURE_BUMPED) != 0u);
    }
    delta_only = delta_only && singular;
    straight = straight || closure_type(c) == HW_CLOSURE_TRANSPARENT;
  }

  SurfacePoint point;
  point.position = g.P;
  point.normal = Ng;
  point.shading_normal = N;
  point.terminator_offset = backfacing || g.terminator_cutoff <= 0.0 ? vec3(0.0) : g.terminator_offset;
  point.terminator_cutoff = g.terminator_cutoff;
  point.receiver = (octahedral_pack(receiver) & ~HW_RECEIVER_TRANSMITS) | (transmits ? HW_RECEIVER_TRANSMITS : 0u);
  point.closure_count = count;
  point.flags = sg.flags | (delta_only ? HW_SURFACE_DELTA_ONLY : 0u) | (delta_only || straight ? HW_SURFACE_WHOLE : 0u) | (sharp > 2.0 * blurry ? HW_SURFACE_GLOSSY : 0u);
  if (HW_PATH_REUSE) {
    point.flags |= !straight && min(reflected.x, min(reflected.y, reflected.z)) > 1e-3 * max(reflected.x, max(reflected.y, reflected.z)) ? HW_SURFACE_GIVES : 0u;
    point.flags |= !straight && !bumped_reflection ? HW_SURFACE_GIVES_GLOSSY : 0u;
    point.flags |= (material_flags & HW_MATERIAL_UNEVEN) != 0u ? HW_SURFACE_UNEVEN : 0u;
  }
  surface_store(path, point);
  path_store_progress(path, state);
  queue_push(push.out_queue, path);
}

void main() {
  QueueRef queue = QueueRef(push.queue);
  if (gl_GlobalInvocationID.x >= queue.header.count) return;
  uint path = queued(gl_GlobalInvocationID.x);
  met_surface(path, path_load(path), ray_load(path), hit_load(path));
}
