// SPDX-License-Identifier: Apache-2.0
// Adds the results of a wave to the film, sample after sample in order, so that sums do not depend on how samples were
// grouped into waves. One thread a pixel of the wave.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= HW_FRAME.wave_pixels) return;
  uint stride = HW_FRAME.film_stride;
  uint samples = HW_FRAME.wave_samples * HW_FRAME.bounce_samples;
  FloatBuffer film = FloatBuffer(HW_FRAME.film);
  FloatBuffer results = FloatBuffer(HW_FRAME.results);
  uint pixel = HW_FRAME.first_pixel + i;
  for (uint c = 0u; c < stride; ++c) {
    float sum = film.at[pixel * stride + c];
    for (uint s = 0u; s < samples; ++s) sum += results.at[(i * samples + s) * stride + c];
    film.at[pixel * stride + c] = sum;
  }
}
