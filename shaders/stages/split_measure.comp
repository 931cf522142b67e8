// SPDX-License-Identifier: Apache-2.0
// What a wave of paths, split in three or not at all, tells of how much they and their parts differ (shared/path.h,
// SplitRecord). One thread a path of the camera, which has a record to itself.
// a: which of the two paths of a pixel these are; out_queue: SplitRecord[pixels of the preparation].
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/light_proxy.h"
#include "lib/path_reuse.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer SplitRecordArray { SplitRecord at[]; };

float part(uint path) {
  uint first = path * HW_FRAME.film_stride + HW_FRAME.pass_offset[HW_PASS_COMBINED];
  return luminance(vec3(float_at(HW_FRAME.results, first), float_at(HW_FRAME.results, first + 1u),
                        float_at(HW_FRAME.results, first + 2u)));
}

float shared_part(uint anchor, uint path) {
  SharedVertex v = SharedVertexArray(HW_FRAME.shared_vertices).at[path];
  bool met = (path_flags(anchor) & HW_PATH_ANCHOR) != 0u && v.kind == HW_SHARED_MET;
  return met ? luminance(v.light) : 0.0;
}

void main() {
  uint number = gl_GlobalInvocationID.x;
  if (number >= HW_FRAME.wave_pixels) return;
  uint first = number * HW_FRAME.places;
  bool split = HW_FRAME.bounce_samples > 2u;
  float b = split ? part(first + 1u) : 0.0, c = split ? part(first + 2u) : 0.0;
  float light = part(first) + b + c, kept = (b - c) * (b - c);
  // Path reuse: a place more, and what is to be shared lies apart.
  if (HW_FRAME.places > 3u) {
    float shared_b = shared_part(first, first + 1u), shared_c = shared_part(first, first + 2u);
    light += part(first + 3u) + shared_b + shared_c + shared_part(first, first + 3u);
    b += shared_b;
    c += shared_c;
  }
  SplitRecordArray records = SplitRecordArray(push.out_queue);
  records.at[HW_FRAME.first_pixel + number].light[push.a] = light;
  records.at[HW_FRAME.first_pixel + number].apart[push.a] = (b - c) * (b - c);
  records.at[HW_FRAME.first_pixel + number].kept[push.a] = kept;
}
