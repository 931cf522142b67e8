// SPDX-License-Identifier: Apache-2.0
// Reads and writes what stages share in a frame: path arrays, queues, results (shared/path.h).
#ifndef HW_WAVE_GLSL
#define HW_WAVE_GLSL
#include "features.glsl"
#include "tables.glsl"

layout(set = 0, binding = 1, scalar) uniform FrameBlock { FrameParams frame; } hw_frame;
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PathArray { PathState at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer RayArray { Ray at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer HitArray { Hit at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ShadowArray { ShadowState at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SurfaceArray { SurfacePoint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SplitArray { PathSplit at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ReservoirArray { Reservoir at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ReuseSurfaceArray { ReuseSurface at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer LightProxyArray { LightProxy at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FloatBuffer { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintBuffer { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer CounterBuffer { RayCounters counters; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer QueueRef { QueueHeader header; uint path[]; };

#define HW_FRAME hw_frame.frame

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
void result_add3(uint path, uint pass, vec3 v) {
  v = abs(v.x) + abs(v.y) + abs(v.z) < HW_RESULT_LIMIT ? v : vec3(0.0);
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

// Adds light that arrived at the camera. `bounce` counts scatterings before the light: 0 seen directly, 1 direct light.
void result_add_light(uint path, vec3 radiance, uint bounce, vec3 diffuse_share, vec3 glossy_share) {
  vec3 v = clamp_contribution(radiance, bounce > 1u ? HW_FRAME.clamp_indirect : HW_FRAME.clamp_direct);
  result_add3(path, HW_PASS_COMBINED, v);
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
