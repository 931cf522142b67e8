// SPDX-License-Identifier: Apache-2.0
// Memory by address in 64-bit words. Lavapipe before Mesa 24 makes of each component of such a load or store a loop over
// the lanes, 70 to 80 cycles long, whatever the component's width: records that hits read and write in bulk are moved in
// words of twice the width, at half the cost, and read through the memory window. Elsewhere words make no difference that
// was seen.
#ifndef HW_WORDS_GLSL
#define HW_WORDS_GLSL
#include "../shared/portable.h"
#include "root.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer Words { uint64_t at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Uints { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 1) readonly buffer Bytes { uint8_t at[]; };

// The memory window (core/gpu/memory_window.cpp): all that a kernel reads, as texels. Where it begins is not a constant of
// the kernel: drivers keep compiled kernels from one process to the next.
layout(constant_id = 30) const bool HW_WINDOWED = false;
layout(set = 0, binding = 2) uniform utextureBuffer hw_window;

// The functions below read what earlier dispatches have written, never what this one does: that is `Words(address).at[i]`.

// Word `i` from an address on (a multiple of 8).
uint64_t word_at(uint64_t address, uint i) {
  if (HW_WINDOWED)
    return packUint2x32(texelFetch(hw_window, int(((uint(address) - HW_ROOT.window) >> 3u) + i)).xy);
  return Words(address).at[i];
}

// 32-bit number `i` from an address on (a multiple of 4).
uint uint_at(uint64_t address, uint i) {
  if (HW_WINDOWED) {
    uint number = ((uint(address) - HW_ROOT.window) >> 2u) + i;
    uvec2 both = texelFetch(hw_window, int(number >> 1u)).xy;
    return (number & 1u) != 0u ? both.y : both.x;
  }
  return Uints(address).at[i];
}
float float_at(uint64_t address, uint i) { return uintBitsToFloat(uint_at(address, i)); }
// Byte `i` from an address on.
uint byte_at(uint64_t address, uint i) {
  if (HW_WINDOWED) {
    uint number = uint(address) - HW_ROOT.window + i;
    uvec2 both = texelFetch(hw_window, int(number >> 3u)).xy;
    return (((number & 4u) != 0u ? both.y : both.x) >> ((number & 3u) * 8u)) & 255u;
  }
  return uint(Bytes(address).at[i]);
}

// Of a word, the 32 bits at the lower and at the higher address.
uint word_low(uint64_t w) { return unpackUint2x32(w).x; }
uint word_high(uint64_t w) { return unpackUint2x32(w).y; }
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
  uint64_t w = array + uint64_t(index >> 1u) * 24ul + uint64_t(first >> 1u) * 8ul;
  uint64_t a = word_at(w, 0u), b = word_at(w, 1u);
  return first == 0u ? uvec3(word_low(a), word_high(a), word_low(b)) : uvec3(word_high(a), word_low(b), word_high(b));
}
vec3 word_vector(uint64_t array, uint index) { return uintBitsToFloat(word_triple(array, index)); }

// Numbers `first` and `first + 1` of an array of 32-bit floats that is laid out so too.
vec2 word_two_floats(uint64_t array, uint first) {
  uint64_t w = array + uint64_t(first >> 1u) * 8ul;
  vec2 r = word_floats(word_at(w, 0u));
  if ((first & 1u) != 0u) { r = vec2(r.y, word_low_float(word_at(w, 1u))); }
  return r;
}
#endif
