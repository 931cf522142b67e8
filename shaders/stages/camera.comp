// SPDX-License-Identifier: Apache-2.0
// Starts the paths of a wave: one camera ray each, state and results cleared, all ids queued in order.
// variant camera_sampled: HW_SAMPLED_BLOCKS
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/camera.h"
#include "lib/filter.h"
#include "lib/sampler.h"
#ifdef HW_SAMPLED_BLOCKS
#include "lib/sampled_blocks.glsl"
#endif
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint path = gl_GlobalInvocationID.x;
  uint count = HW_FRAME.wave_pixels * HW_FRAME.wave_samples;
  if (path == 0u) QueueRef(push.out_queue).header.count = count;
  if (path >= count * HW_FRAME.places) return;
  uint stride = HW_FRAME.film_stride;
  FloatBuffer results = FloatBuffer(HW_FRAME.results);
  for (uint c = 0u; c < stride; ++c) results.at[path * stride + c] = 0.0;
  // Places that are left for paths that go on from what this one finds.
  uint number = path / HW_FRAME.places;
  if (path != number * HW_FRAME.places) return;
  results.at[path * stride + HW_FRAME.pass_offset[HW_PASS_COMBINED] + 3u] = 1.0;  // alpha: what a miss takes away
  if (pass_on(HW_PASS_MIST)) results.at[path * stride + HW_FRAME.pass_offset[HW_PASS_MIST]] = 1.0;  // less what surfaces show

#ifdef HW_SAMPLED_BLOCKS
  SampledPixel sampled = sampled_pixel(HW_FRAME.first_pixel + number);
  uint pixel = sampled.inside ? sampled.y * HW_FRAME.region_width + sampled.x : 0u;
  uint index = HW_FRAME.first_sample_of_render + sampled.number;
#else
  uint pixel = HW_FRAME.first_pixel + number / HW_FRAME.wave_samples;
  uint index = HW_FRAME.first_sample + number % HW_FRAME.wave_samples;
  if (HW_FRAME.pixels_a_path > 1u) {
    uint among = sampler_hash(sampler_hash_combine(pixel, HW_FRAME.preparation_seed)) % HW_FRAME.pixels_a_path;
    pixel = min(pixel * HW_FRAME.pixels_a_path + among, HW_FRAME.region_width * HW_FRAME.region_height - 1u);
  }
#endif
  uint x = HW_FRAME.region_x + pixel % HW_FRAME.region_width;
  uint y = HW_FRAME.region_y + pixel / HW_FRAME.region_width;
  uint hash = sampler_pixel_hash(x, y);

  vec2 offset = filter_sample(HW_FRAME.filter_type, HW_FRAME.filter_width,
                              sampler_2d(hash, index, HW_DIM_FILTER, HW_FRAME.seed));
  // Passes of one sample show the pixel's centre, as Cycles' do; without them no sample is spent on it.
  const uint centre_passes =
      1u << HW_PASS_DEPTH | 1u << HW_PASS_POSITION | 1u << HW_PASS_OBJECT_INDEX | 1u << HW_PASS_MATERIAL_INDEX;
  if ((HW_PASSES & centre_passes) != 0u && index == HW_FRAME.first_sample_of_render) offset = vec2(0.0);
  vec2 raster = (vec2(x, y) + 0.5 + offset) / vec2(HW_FRAME.width, HW_FRAME.height);
  CameraRecord camera = HW_ROOT.camera;
  vec2 lens = vec2(0.5);
  if (camera.aperture_radius > 0.0) lens = sampler_2d(hash, index, HW_DIM_LENS, HW_FRAME.seed);
  Ray ray;
  camera_ray(camera, raster, lens, ray.origin, ray.direction, ray.tmin, ray.tmax);
  // The ray starts on the near clip plane, as Cycles' does: its length is what Light Path > Ray Length reads.
  ray.origin += ray.direction * ray.tmin;
  ray.tmax -= ray.tmin;
  ray.tmin = 0.0;
  bool seen = dot(ray.direction, ray.direction) > 0.0;  // else the panorama shows nothing here: black
#ifdef HW_SAMPLED_BLOCKS
  seen = seen && sampled.inside;
#endif
  if (!seen) ray.direction = vec3(0.0, 0.0, 1.0);
  ray.mask = seen ? HW_MASK_CAMERA | HW_MASK_LAMP : 0u;
  ray.flags = 0u;
  ray_store(path, ray);

  PathState state;
  state.throughput = vec3(seen ? 1.0 : 0.0);
  state.mis_pdf = 0.0;
  state.mis_origin = ray.origin;
  state.min_pdf = HW_INFINITY;
  state.pixel = pixel;
  state.sample_index = index;
  state.flags = HW_PATH_CAMERA | HW_PATH_BACKGROUND_VISIBLE;
  state.bounces = 0u;
  state.transparent = 0u;
  state.seed = hash;
  state.mis_normal = 0u;
  state.mis_cell = HW_NONE;
  path_store(path, state);
  UintBuffer q = UintBuffer(push.out_queue + HW_QUEUE_HEADER_BYTES);
  q.at[number] = path;

  if (HW_LIGHT_PASSES || HW_FEATURE_PASSES) {
    PathSplit split;
    split.feature = vec3(1.0);
    split.diffuse = vec3(0.0);
    split.glossy = vec3(0.0);
    SplitArray(HW_FRAME.splits).at[path] = split;
  }
}
