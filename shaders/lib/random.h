// SPDX-License-Identifier: Apache-2.0
// A stream of random numbers for one thread, where many are wanted and their spread does not matter: PCG (O'Neill 2014)
// in the 32-bit form of Jarzynski and Olano 2020.
#ifndef HW_RANDOM_H
#define HW_RANDOM_H
#include "sampler.h"
HW_NAMESPACE_BEGIN

// Purposes of streams: two streams of one path with different purposes are independent.
HW_CONST uint HW_STREAM_CANDIDATES = 1u;
HW_CONST uint HW_STREAM_REUSE = 2u;
HW_CONST uint HW_STREAM_CELL = 3u;

// `pass` counts passes over frames too: with the same numbers as in the frame before, a reservoir would be offered
// again what it has seen.
HW_FN uint random_stream(uint pixel_hash, uint pass, uint bounce, uint purpose, uint seed) {
  uint h = sampler_hash(pixel_hash ^ sampler_hash(pass * 0x9e3779b9u ^ sampler_hash(seed ^ 0x2545f491u)));
  return sampler_hash(h ^ (bounce * 16u + purpose) * 0x85ebca6bu);
}

// The next number in [0, 1).
HW_FN float random_next(HW_INOUT(uint) state) {
  state = state * 747796405u + 2891336453u;
  uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return sampler_to_float((word >> 22u) ^ word);
}

HW_NAMESPACE_END
#endif
