// SPDX-License-Identifier: Apache-2.0
// Reads and writes what stages share in a frame: path arrays, queues, results (shared/path.h).
#ifndef HW_WAVE_GLSL
#define HW_WAVE_GLSL
#include "features.glsl"
#include "tables.glsl"
#include "words.glsl"

layout(set = 0, binding = 1, scalar) uniform FrameBlock { FrameParams frame; } hw_frame;
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PathArray { PathState at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer RayArray { Ray at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer HitArray { Hit at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ShadowArray { ShadowState at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SplitArray { PathSplit at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ReservoirArray { Reservoir at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ReuseSurfaceArray { ReuseSurface at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer LightProxyArray { LightProxy at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatBuffer { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintBuffer { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CounterBuffer { RayCounters counters; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer QueueRef { QueueHeader header; uint path[]; };

#define HW_FRAME hw_frame.frame

// The records that every hit reads and writes, by words (lib/words.glsl). The structs' sizes are asserted where they are
// declared; the order of their members is what these functions follow.
PathState path_load(uint path) {
  uint64_t w = HW_FRAME.paths + uint64_t(path) * HW_PATH_BYTES;
  uint64_t w2 = word_at(w, 2u), w4 = word_at(w, 4u), w5 = word_at(w, 5u), w6 = word_at(w, 6u);
  PathState s;
  vec2 w1 = word_floats(word_at(w, 1u));
  vec2 w3 = word_floats(word_at(w, 3u));
  s.throughput = vec3(word_floats(word_at(w, 0u)), w1.x);
  s.mis_pdf = w1.y;
  s.mis_origin = vec3(word_floats(w2), w3.x);
  s.min_pdf = w3.y;
  s.pixel = word_low(w4);
  s.sample_index = word_high(w4);
  s.flags = word_low(w5);
  s.bounces = word_high(w5);
  s.transparent = word_low(w6);
  s.seed = word_high(w6);
  s.mis_normal = 0u;
  s.mis_cell = HW_NONE;
  if (HW_HAS(HW_FEATURE_LIGHT_TREE)) {
    uint64_t w7 = word_at(w, 7u);
    s.mis_normal = word_low(w7);
    s.mis_cell = word_high(w7);
  }
  return s;
}
void path_store(uint path, PathState s) {
  Words w = Words(HW_FRAME.paths + uint64_t(path) * HW_PATH_BYTES);
  w.at[0] = word_of(s.throughput.x, s.throughput.y);
  w.at[1] = word_of(s.throughput.z, s.mis_pdf);
  w.at[2] = word_of(s.mis_origin.x, s.mis_origin.y);
  w.at[3] = word_of(s.mis_origin.z, s.min_pdf);
  w.at[4] = word_of(s.pixel, s.sample_index);
  w.at[5] = word_of(s.flags, s.bounces);
  w.at[6] = word_of(s.transparent, s.seed);
  if (HW_HAS(HW_FEATURE_LIGHT_TREE)) w.at[7] = word_of(s.mis_normal, s.mis_cell);
}
// What the surface stage changes.
void path_store_progress(uint path, PathState s) {
  Words w = Words(HW_FRAME.paths + uint64_t(path) * HW_PATH_BYTES);
  w.at[0] = word_of(s.throughput.x, s.throughput.y);
  w.at[1] = word_of(s.throughput.z, s.mis_pdf);
  w.at[5] = word_of(s.flags, s.bounces);
}

Ray ray_of_words(uint64_t w) {
  uint64_t w1 = word_at(w, 1u), w3 = word_at(w, 3u);
  Ray r;
  r.origin = vec3(word_floats(word_at(w, 0u)), word_low_float(w1));
  r.tmin = word_high_float(w1);
  r.direction = vec3(word_floats(word_at(w, 2u)), word_low_float(w3));
  r.tmax = word_high_float(w3);
  uint64_t w4 = word_at(w, 4u);
  r.mask = word_low(w4);
  r.flags = word_high(w4);
  return r;
}
void ray_to_words(Words w, Ray r) {
  w.at[0] = word_of(r.origin.x, r.origin.y);
  w.at[1] = word_of(r.origin.z, r.tmin);
  w.at[2] = word_of(r.direction.x, r.direction.y);
  w.at[3] = word_of(r.direction.z, r.tmax);
  w.at[4] = word_of(r.mask, r.flags);
}
Ray ray_load(uint path) { return ray_of_words(HW_FRAME.rays + uint64_t(path) * HW_RAY_BYTES); }
void ray_store(uint path, Ray r) { ray_to_words(Words(HW_FRAME.rays + uint64_t(path) * HW_RAY_BYTES), r); }
// Shadow ray `number` of a path (ShadowState).
uint shadow_of(uint path, uint number) { return path * HW_FRAME.light_samples + number; }
uint path_of_shadow(uint shadow) { return shadow / HW_FRAME.light_samples; }
void shadow_ray_store(uint shadow, Ray r) { ray_to_words(Words(HW_FRAME.shadow_rays + uint64_t(shadow) * HW_RAY_BYTES), r); }

Hit hit_load(uint path) {
  uint64_t w = HW_FRAME.hits + uint64_t(path) * HW_HIT_BYTES;
  uint64_t w0 = word_at(w, 0u), w1 = word_at(w, 1u);
  Hit h;
  h.t = word_low_float(w0);
  h.u = word_high_float(w0);
  h.v = word_low_float(w1);
  h.instance = word_high(w1);
  h.primitive = word_low(word_at(w, 2u));
  h.pad = 0u;
  return h;
}

// Nothing of a flat scene's shading normals is kept.
SurfacePoint surface_load(uint path) {
  uint64_t w = HW_FRAME.surfaces + uint64_t(path) * HW_SURFACE_POINT_BYTES;
  SurfacePoint p;
  uint64_t w7 = word_at(w, 7u);
  words_to_vectors(word_at(w, 0u), word_at(w, 1u), word_at(w, 2u), p.position, p.normal);
  p.shading_normal = p.normal;
  p.terminator_offset = vec3(0.0);
  p.terminator_cutoff = 0.0;
  if (HW_HAS(HW_FEATURE_BUMP)) {
    words_to_vectors(word_at(w, 3u), word_at(w, 4u), word_at(w, 5u), p.shading_normal, p.terminator_offset);
  }
  p.receiver = 0u;
  if (HW_HAS(HW_FEATURE_BUMP | HW_FEATURE_LIGHT_TREE)) {
    uint64_t w6 = word_at(w, 6u);
    if (HW_HAS(HW_FEATURE_BUMP)) p.terminator_cutoff = word_low_float(w6);
    p.receiver = word_high(w6);
  }
  p.closure_count = word_low(w7);
  p.flags = word_high(w7);
  return p;
}
void surface_store(uint path, SurfacePoint p) {
  Words w = Words(HW_FRAME.surfaces + uint64_t(path) * HW_SURFACE_POINT_BYTES);
  w.at[0] = word_of(p.position.x, p.position.y);
  w.at[1] = word_of(p.position.z, p.normal.x);
  w.at[2] = word_of(p.normal.y, p.normal.z);
  if (HW_HAS(HW_FEATURE_BUMP)) {
    w.at[3] = word_of(p.shading_normal.x, p.shading_normal.y);
    w.at[4] = word_of(p.shading_normal.z, p.terminator_offset.x);
    w.at[5] = word_of(p.terminator_offset.y, p.terminator_offset.z);
  }
  if (HW_HAS(HW_FEATURE_BUMP | HW_FEATURE_LIGHT_TREE))
    w.at[6] = word_of(floatBitsToUint(p.terminator_cutoff), p.receiver);
  w.at[7] = word_of(p.closure_count, p.flags);
}

Words shadow_words(uint shadow) { return Words(HW_FRAME.shadows + uint64_t(shadow) * HW_SHADOW_BYTES); }
void shadow_store(uint shadow, ShadowState s) {
  Words w = shadow_words(shadow);
  w.at[0] = word_of(s.radiance.x, s.radiance.y);
  w.at[1] = word_of(floatBitsToUint(s.radiance.z), s.bounce);
  if (HW_LIGHT_PASSES) w.at[2] = word_of(s.diffuse.x, s.diffuse.y);
  w.at[3] = word_of(floatBitsToUint(s.diffuse.z), s.light);
  if (HW_LIGHT_PASSES) w.at[4] = word_of(s.glossy.x, s.glossy.y);
  w.at[5] = word_of(floatBitsToUint(s.glossy.z), s.transparent);
  if (HW_HAS(HW_FEATURE_EMISSION_PROGRAM)) w.at[6] = word_of(s.uv.x, s.uv.y);
  if (HW_HAS(HW_FEATURE_LIGHT_CELLS)) w.at[7] = word_of(s.slot, floatBitsToUint(s.teaches));
}
// What light that arrived is added by.
ShadowState shadow_load(uint shadow) {
  uint64_t w = HW_FRAME.shadows + uint64_t(shadow) * HW_SHADOW_BYTES;
  uint64_t w1 = word_at(w, 1u);
  ShadowState s;
  s.radiance = vec3(word_floats(word_at(w, 0u)), word_low_float(w1));
  s.bounce = word_high(w1);
  s.diffuse = vec3(0.0);
  s.glossy = vec3(0.0);
  s.light = HW_NONE;
  if (HW_LIGHT_PASSES || HW_HAS(HW_FEATURE_LIGHT_CELLS)) {
    uint64_t w3 = word_at(w, 3u);
    s.diffuse.z = word_low_float(w3);
    s.light = word_high(w3);
  }
  if (HW_LIGHT_PASSES) {
    s.diffuse = vec3(word_floats(word_at(w, 2u)), s.diffuse.z);
    s.glossy = vec3(word_floats(word_at(w, 4u)), word_low_float(word_at(w, 5u)));
  }
  s.transparent = 0u;
  s.uv = vec2(0.0);
  s.slot = 0u;
  s.teaches = 0.0;
  if (HW_HAS(HW_FEATURE_LIGHT_CELLS)) {
    uint64_t w7 = word_at(w, 7u);
    s.slot = word_low(w7);
    s.teaches = word_high_float(w7);
  }
  return s;
}

// Path `i` of the queue that this dispatch works through.
uint queued(uint i) { return uint_at(push.queue + HW_QUEUE_HEADER_BYTES, i); }

void queue_push(uint64_t queue, uint path) {
  QueueRef q = QueueRef(queue);
  uint slot = atomicAdd(q.header.count, 1u);
  q.path[slot] = path;
}

// A pass is compiled in only when some view layer asks for it.
bool pass_on(uint pass) { return (HW_PASSES & (1u << pass)) != 0u; }

// Radiance, and any pass's value, beyond what sums of many samples can hold. NaN is not below it either.
const float HW_RESULT_LIMIT = 1e30;

// A value that is not finite, or so large that sums would not be, counts as 0: one bad sample must not spoil a pixel.
vec3 result_value(vec3 v) { return abs(v.x) + abs(v.y) + abs(v.z) < HW_RESULT_LIMIT ? v : vec3(0.0); }
void result_add3(uint path, uint pass, vec3 v) {
  v = result_value(v);
  uint o = path * HW_FRAME.film_stride + HW_FRAME.pass_offset[pass];
  FloatBuffer r = FloatBuffer(HW_FRAME.results);
  r.at[o] += v.x;
  r.at[o + 1u] += v.y;
  r.at[o + 2u] += v.z;
}
void result_add1(uint path, uint pass, float v) {
  v = abs(v) < HW_RESULT_LIMIT ? v : 0.0;
  FloatBuffer(HW_FRAME.results).at[path * HW_FRAME.film_stride + HW_FRAME.pass_offset[pass]] += v;
}

void result_add1_at(uint path, uint pass, uint channel, float v) {
  v = abs(v) < HW_RESULT_LIMIT ? v : 0.0;
  FloatBuffer(HW_FRAME.results).at[path * HW_FRAME.film_stride + HW_FRAME.pass_offset[pass] + channel] += v;
}

// Bounds a contribution by Cycles' rule: the sum of the absolute channels is at most three times the limit.
vec3 clamp_contribution(vec3 v, float limit) {
  float sum = abs(v.x) + abs(v.y) + abs(v.z);
  return sum > limit ? v * (limit / sum) : v;
}

// The shares of light in the passes by lobe. `v`: as result_clamp leaves it.
void result_add_light_passes(uint path, vec3 v, uint bounce, vec3 diffuse_share, vec3 glossy_share) {
  if (HW_LIGHT_PASSES) {
    if (bounce >= 1u) {
      vec3 d = v * diffuse_share, g = v * glossy_share, t = v - d - g;
      bool direct = bounce == 1u;
      if (pass_on(HW_PASS_DIFFUSE_DIRECT) && direct) result_add3(path, HW_PASS_DIFFUSE_DIRECT, d);
      if (pass_on(HW_PASS_DIFFUSE_INDIRECT) && !direct) result_add3(path, HW_PASS_DIFFUSE_INDIRECT, d);
      if (pass_on(HW_PASS_GLOSSY_DIRECT) && direct) result_add3(path, HW_PASS_GLOSSY_DIRECT, g);
      if (pass_on(HW_PASS_GLOSSY_INDIRECT) && !direct) result_add3(path, HW_PASS_GLOSSY_INDIRECT, g);
      if (pass_on(HW_PASS_TRANSMISSION_DIRECT) && direct) result_add3(path, HW_PASS_TRANSMISSION_DIRECT, t);
      if (pass_on(HW_PASS_TRANSMISSION_INDIRECT) && !direct) result_add3(path, HW_PASS_TRANSMISSION_INDIRECT, t);
    }
  }
}

// `bounce` counts scatterings before the light: 0 seen directly, 1 direct light. `split`: the path is one of several that
// share a sample.
vec3 result_clamp(vec3 radiance, uint bounce, bool split) {
  float limit = bounce > 1u ? HW_FRAME.clamp_indirect : HW_FRAME.clamp_direct;
  return clamp_contribution(radiance, split ? limit / float(HW_FRAME.bounce_samples) : limit);
}

// Adds light that arrived at the camera.
void result_add_light(uint path, vec3 radiance, uint bounce, bool split, vec3 diffuse_share, vec3 glossy_share) {
  vec3 v = result_clamp(radiance, bounce, split);
  result_add3(path, HW_PASS_COMBINED, v);
  result_add_light_passes(path, v, bounce, diffuse_share, glossy_share);
}

// Power heuristic (Veach 1995, beta = 2), as Cycles weighs light against BSDF samples.
float mis_power(float a, float b) {
  float r = b / max(a, 1e-30);
  return 1.0 / (1.0 + r * r);
}

uint path_bounce(uint bounces) { return bounces & 255u; }

// Moves a ray's origin off the surface by a few units in the last place along the normal.
// Waechter and Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection", with a wider margin for points
// that went through an instance's transform.
vec3 offset_origin(vec3 p, vec3 n) {
  const float small = 1.0 / 32.0;
  const float scale_int = 512.0;
  const float scale_float = 1.0 / 32768.0;
  ivec3 step = ivec3(n * scale_int);
  vec3 moved = vec3(intBitsToFloat(floatBitsToInt(p.x) + (p.x < 0.0 ? -step.x : step.x)),
                    intBitsToFloat(floatBitsToInt(p.y) + (p.y < 0.0 ? -step.y : step.y)),
                    intBitsToFloat(floatBitsToInt(p.z) + (p.z < 0.0 ? -step.z : step.z)));
  return vec3(abs(p.x) < small ? p.x + scale_float * n.x : moved.x,
              abs(p.y) < small ? p.y + scale_float * n.y : moved.y,
              abs(p.z) < small ? p.z + scale_float * n.z : moved.z);
}
#endif
