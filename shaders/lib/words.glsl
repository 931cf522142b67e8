// SPDX-License-Identifier: Apache-2.0
// Memory by address in 64-bit words. Lavapipe before Mesa 24 makes of each component of such a load or store a loop over
// the lanes, 70 to 80 cycles long, whatever the component's width: records that hits read and write in bulk are moved in
// words of twice the width, at half the cost. Elsewhere it makes no difference that was seen.
#ifndef HW_WORDS_GLSL
#define HW_WORDS_GLSL
#include "../shared/portable.h"

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer Words { uint64_t at[]; };

// Of a word, the 32 bits at the lower and at the higher address.
uint word_low(uint64_t w) { return uint(w); }
uint word_high(uint64_t w) { return uint(w >> 32); }
float word_low_float(uint64_t w) { return uintBitsToFloat(word_low(w)); }
float word_high_float(uint64_t w) { return uintBitsToFloat(word_high(w)); }
vec2 word_floats(uint64_t w) { return vec2(word_low_float(w), word_high_float(w)); }

uint64_t word_of(uint low, uint high) { return uint64_t(low) | (uint64_t(high) << 32); }
uint64_t word_of(float low, float high) { return word_of(floatBitsToUint(low), floatBitsToUint(high)); }

// Two vectors that follow one another, from and to three words.
void words_to_vectors(uint64_t w0, uint64_t w1, uint64_t w2, out vec3 a, out vec3 b) {
  vec2 middle = word_floats(w1);
  a = vec3(word_floats(w0), middle.x);
  b = vec3(middle.y, word_floats(w2));
}

// Element `index` of a packed array of three 32-bit numbers each: the two words it lies in, of which half of one is a
// neighbour's. The array starts at a word and is padded to one (core/scene/tables_meshes.cpp).
uvec3 word_triple(uint64_t array, uint index) {
  uint first = 3u * (index & 1u);  // 32-bit numbers from the last even element
  Words w = Words(array + uint64_t(index >> 1u) * 24ul + uint64_t(first >> 1u) * 8ul);
  uint64_t a = w.at[0], b = w.at[1];
  return first == 0u ? uvec3(word_low(a), word_high(a), word_low(b)) : uvec3(word_high(a), word_low(b), word_high(b));
}
vec3 word_vector(uint64_t array, uint index) { return uintBitsToFloat(word_triple(array, index)); }

// Numbers `first` and `first + 1` of an array of 32-bit floats that is laid out so too.
vec2 word_two_floats(uint64_t array, uint first) {
  Words w = Words(array + uint64_t(first >> 1u) * 8ul);
  vec2 r = word_floats(w.at[0]);
  if ((first & 1u) != 0u) { r = vec2(r.y, word_low_float(w.at[1])); }
  return r;
}
#endif
