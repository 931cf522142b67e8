// SPDX-License-Identifier: Apache-2.0
// The pixels of a pass of adaptive sampling: those of the blocks that it lists, one block after the other.
#ifndef HW_SAMPLED_BLOCKS_GLSL
#define HW_SAMPLED_BLOCKS_GLSL
#include "wave.glsl"

struct SampledPixel {
  uint x, y;     // within the region
  bool inside;   // else it lies in a block that reaches over the region's edge, and is not there
  uint number;   // of the sample
  bool odd;      // which half of the pixel's samples it belongs to
  float weight;  // passes that the sample stands for
};

// Pixel `number` of the pass.
SampledPixel sampled_pixel(uint number) {
  uint64_t record = word_at(HW_FRAME.sampled_blocks, number / HW_BLOCK_PIXELS);
  uint block = word_low(record), sampling = word_high(record);
  uint across = blocks_along(HW_FRAME.region_width);
  uint place = number % HW_BLOCK_PIXELS;
  SampledPixel p;
  p.x = block % across * HW_BLOCK_SIDE + place % HW_BLOCK_SIDE;
  p.y = block / across * HW_BLOCK_SIDE + place / HW_BLOCK_SIDE;
  p.inside = p.x < HW_FRAME.region_width && p.y < HW_FRAME.region_height;
  p.number = sampling & (HW_SAMPLE_ODD - 1u);
  p.odd = (sampling & HW_SAMPLE_ODD) != 0u;
  p.weight = float(1u << (sampling >> HW_SAMPLE_WEIGHT_SHIFT));
  return p;
}
#endif
