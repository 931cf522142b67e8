// SPDX-License-Identifier: Apache-2.0
// Adds the results of a wave to the film, sample after sample in order, so that sums do not depend on how samples were
// grouped into waves. One thread a pixel of the wave. accumulate_sampled weighs them, and keeps the sums of half of them
// apart, from which core/session/film_noise.h sees how noisy pixels are.
// variant accumulate_sampled: HW_SAMPLED_BLOCKS
#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef HW_SAMPLED_BLOCKS
#include "lib/sampled_blocks.glsl"
#endif
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= HW_FRAME.wave_pixels) return;
  uint stride = HW_FRAME.film_stride;
  uint samples = HW_FRAME.wave_samples * HW_FRAME.places;
  FloatBuffer film = FloatBuffer(HW_FRAME.film);
  FloatBuffer results = FloatBuffer(HW_FRAME.results);
#ifdef HW_SAMPLED_BLOCKS
  SampledPixel sampled = sampled_pixel(HW_FRAME.first_pixel + i);
  if (!sampled.inside) return;
  uint record = (sampled.y * HW_FRAME.region_width + sampled.x) * HW_FRAME.film_pixel_stride;
  for (uint c = 0u; c < stride; ++c) {
    float sum = 0.0;
    for (uint s = 0u; s < samples; ++s) sum += results.at[(i * samples + s) * stride + c];
    film.at[record + c] += sampled.weight * sum;
    uint channel = c - HW_FRAME.pass_offset[HW_PASS_COMBINED];
    if (!sampled.odd && channel < 3u) film.at[record + stride + 2u + channel] += sampled.weight * sum;
  }
  film.at[record + stride] += sampled.weight;
  if (!sampled.odd) film.at[record + stride + 1u] += sampled.weight;
#else
  uint pixel = HW_FRAME.first_pixel + i;
  for (uint c = 0u; c < stride; ++c) {
    float sum = film.at[pixel * stride + c];
    for (uint s = 0u; s < samples; ++s) sum += results.at[(i * samples + s) * stride + c];
    film.at[pixel * stride + c] = sum;
  }
#endif
}
