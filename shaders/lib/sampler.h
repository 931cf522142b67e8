// SPDX-License-Identifier: Apache-2.0
// Owen-scrambled Sobol points, padded: every group of up to four dimensions is a Sobol sequence of its own, shuffled
// and scrambled by hashes (Burley 2020, "Practical Hash-based Owen Scrambling", with the Laine-Karras permutation
// refined by Vegdahl). No tables: generator matrices are applied by shifts, direction numbers computed on the way (Joe
// and Kuo 2008).
#ifndef HW_SAMPLER_H
#define HW_SAMPLER_H
#include "../shared/portable.h"
HW_NAMESPACE_BEGIN

// Dimensions are numbered in groups: a call to sampler_1d .. sampler_4d takes one group. The camera has the groups
// below HW_DIM_BOUNCE; bounce b (0: first surface) has HW_DIM_BOUNCE + b * HW_DIM_BOUNCE_STRIDE + one of the names
// after it.
HW_CONST uint HW_DIM_FILTER = 0u;  // 2: position in the pixel
HW_CONST uint HW_DIM_LENS = 1u;    // 2: position on the aperture
HW_CONST uint HW_DIM_TIME = 2u;    // 1: shutter (reserved)
HW_CONST uint HW_DIM_BOUNCE = 4u;
HW_CONST uint HW_DIM_LIGHT = 1u;        // 3: which light and where on it, spread together over each light
HW_CONST uint HW_DIM_BSDF = 2u;         // 3: lobe, direction
HW_CONST uint HW_DIM_ROULETTE = 3u;     // 1: Russian roulette
HW_CONST uint HW_DIM_TRANSPARENT = 4u;  // 1: stochastic transparency
HW_CONST uint HW_DIM_SHADER = 5u;       // 3: whatever a material program wants
HW_CONST uint HW_DIM_BOUNCE_STRIDE = 8u;
HW_FN uint sampler_dimension(uint bounce, uint name) { return HW_DIM_BOUNCE + bounce * HW_DIM_BOUNCE_STRIDE + name; }

// 32-bit finaliser with full avalanche: Wellons 2018, "hash-prospector" (low bias).
HW_FN uint sampler_hash(uint x) {
  x ^= x >> 16u;
  x *= 0x21f0aaadu;
  x ^= x >> 15u;
  x *= 0xd35a2d97u;
  x ^= x >> 15u;
  return x;
}
HW_FN uint sampler_hash_combine(uint a, uint b) { return sampler_hash(a ^ (b + 0x9e3779b9u + (a << 6u) + (a >> 2u))); }

// Hash of a pixel, for the functions below. Coordinates in the full frame, so that a region renders the same samples.
HW_FN uint sampler_pixel_hash(uint x, uint y) { return sampler_hash(x + sampler_hash(y ^ 0x85ebca6bu)); }

HW_FN uint sampler_reverse_bits(uint x) {
#ifdef __cplusplus
  x = ((x >> 1u) & 0x55555555u) | ((x & 0x55555555u) << 1u);
  x = ((x >> 2u) & 0x33333333u) | ((x & 0x33333333u) << 2u);
  x = ((x >> 4u) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4u);
  x = ((x >> 8u) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8u);
  return (x >> 16u) | (x << 16u);
#else
  return bitfieldReverse(x);
#endif
}

// Owen scrambling from the lowest bit upwards: each bit is flipped by a hash of all lower bits and the seed. Constants
// by Vegdahl 2021 ("Building a Better LK Hash").
HW_FN uint sampler_laine_karras(uint x, uint seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16u) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

// Owen scrambling of a fixed-point number in [0, 1) (high bits decide about low bits).
HW_FN uint sampler_owen(uint x, uint seed) {
  return sampler_reverse_bits(sampler_laine_karras(sampler_reverse_bits(x), seed));
}

// Shuffles the order of samples by Owen scrambling the index as an integer: aligned blocks of 2^k samples stay
// together, so the points stay nets. The low 16 bits only, so that the loops below stay short.
HW_FN uint sampler_shuffle(uint index, uint seed) {
  return (index & 0xffff0000u) | (sampler_owen(index << 16u, seed) >> 16u);
}

// Sobol's second dimension: the Pascal matrix over GF(2), as a product of five sparse factors.
HW_FN uint sampler_sobol_y(uint index) {
  uint x = sampler_reverse_bits(index);
  x ^= x << 16u;
  x ^= (x & 0x00ff00ffu) << 8u;
  x ^= (x & 0x0f0f0f0fu) << 4u;
  x ^= (x & 0x33333333u) << 2u;
  x ^= (x & 0x55555555u) << 1u;
  return x;
}

// Third and fourth dimension: polynomials x^2 + x + 1 with m = 1, 3 and x^3 + x + 1 with m = 1, 3, 1.
HW_FN uint sampler_sobol_z(uint index) {
  uint v0 = 0x80000000u;
  uint v1 = 0xc0000000u;
  uint r = 0u;
  for (uint bits = index; bits != 0u; bits >>= 1u) {
    r ^= v0 & (0u - (bits & 1u));
    uint next = v1 ^ v0 ^ (v0 >> 2u);
    v0 = v1;
    v1 = next;
  }
  return r;
}
HW_FN uint sampler_sobol_w(uint index) {
  uint v0 = 0x80000000u;
  uint v1 = 0xc0000000u;
  uint v2 = 0x20000000u;
  uint r = 0u;
  for (uint bits = index; bits != 0u; bits >>= 1u) {
    r ^= v0 & (0u - (bits & 1u));
    uint next = v1 ^ v0 ^ (v0 >> 3u);
    v0 = v1;
    v1 = v2;
    v2 = next;
  }
  return r;
}

// 24 high bits to [0, 1): every value is exact and below 1.
HW_FN float sampler_to_float(uint x) { return float(x >> 8u) * 5.9604644775390625e-8f; }

// The hash that identifies one group of dimensions of one pixel.
HW_FN uint sampler_group(uint pixel_hash, uint dimension, uint seed) {
  return sampler_hash(pixel_hash ^ sampler_hash(dimension ^ sampler_hash(seed ^ 0x5bd1e995u)));
}

// Samples of a pixel: `index` counts them from 0; any prefix is well spread, powers of two best. The same arguments
// give the same numbers on every device.
HW_FN float sampler_1d(uint pixel_hash, uint index, uint dimension, uint seed) {
  uint h = sampler_group(pixel_hash, dimension, seed);
  // The scrambled van der Corput point: the reversals of both cancel.
  uint i = sampler_shuffle(index, h);
  return sampler_to_float(sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu))));
}
HW_FN vec2 sampler_2d(uint pixel_hash, uint index, uint dimension, uint seed) {
  uint h = sampler_group(pixel_hash, dimension, seed);
  uint i = sampler_shuffle(index, h);
  uint x = sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu)));
  uint y = sampler_owen(sampler_sobol_y(i), sampler_hash(h ^ 0x02e5be93u));
  return vec2(sampler_to_float(x), sampler_to_float(y));
}
HW_FN vec3 sampler_3d(uint pixel_hash, uint index, uint dimension, uint seed) {
  uint h = sampler_group(pixel_hash, dimension, seed);
  uint i = sampler_shuffle(index, h);
  uint x = sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu)));
  uint y = sampler_owen(sampler_sobol_y(i), sampler_hash(h ^ 0x02e5be93u));
  uint z = sampler_owen(sampler_sobol_z(i), sampler_hash(h ^ 0x967a889bu));
  return vec3(sampler_to_float(x), sampler_to_float(y), sampler_to_float(z));
}
HW_FN vec4 sampler_4d(uint pixel_hash, uint index, uint dimension, uint seed) {
  uint h = sampler_group(pixel_hash, dimension, seed);
  uint i = sampler_shuffle(index, h);
  uint x = sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu)));
  uint y = sampler_owen(sampler_sobol_y(i), sampler_hash(h ^ 0x02e5be93u));
  uint z = sampler_owen(sampler_sobol_z(i), sampler_hash(h ^ 0x967a889bu));
  uint w = sampler_owen(sampler_sobol_w(i), sampler_hash(h ^ 0xb5297a4du));
  return vec4(sampler_to_float(x), sampler_to_float(y), sampler_to_float(z), sampler_to_float(w));
}

// Screen-space blue noise, for few samples a pixel: all pixels share one sequence, ordered along the Z-curve and
// shuffled from the top (Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via
// Hierarchical Ordering of Pixels", with binary instead of quaternary digits), so that neighbouring pixels take
// complementary points and their errors cancel under a blur. `log2_samples`: of the samples a pixel will get, rounded
// up; index < 2^log2_samples. The sequence repeats every 2^((32 - log2_samples) / 2) pixels. In each pixel, prefixes
// are as well spread as above.
HW_FN uint sampler_interleave(uint x) {
  x = (x | (x << 8u)) & 0x00ff00ffu;
  x = (x | (x << 4u)) & 0x0f0f0f0fu;
  x = (x | (x << 2u)) & 0x33333333u;
  return (x | (x << 1u)) & 0x55555555u;
}
HW_FN uint sampler_blue_index(uint x, uint y, uint index, uint log2_samples, uint group_hash) {
  uint bits = min((32u - log2_samples) >> 1u, 16u);
  uint mask = (1u << bits) - 1u;
  uint place = sampler_interleave(x & mask) | (sampler_interleave(y & mask) << 1u);
  uint unused = 32u - 2u * bits - log2_samples;
  return sampler_owen(((place << log2_samples) | index) << unused, group_hash) >> unused;
}
HW_FN float sampler_blue_1d(uint x, uint y, uint index, uint log2_samples, uint dimension, uint seed) {
  uint h = sampler_group(0u, dimension, seed);
  uint i = sampler_blue_index(x, y, index, log2_samples, h);
  return sampler_to_float(sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu))));
}
HW_FN vec2 sampler_blue_2d(uint x, uint y, uint index, uint log2_samples, uint dimension, uint seed) {
  uint h = sampler_group(0u, dimension, seed);
  uint i = sampler_blue_index(x, y, index, log2_samples, h);
  uint a = sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu)));
  uint b = sampler_owen(sampler_sobol_y(i), sampler_hash(h ^ 0x02e5be93u));
  return vec2(sampler_to_float(a), sampler_to_float(b));
}
HW_FN vec3 sampler_blue_3d(uint x, uint y, uint index, uint log2_samples, uint dimension, uint seed) {
  uint h = sampler_group(0u, dimension, seed);
  uint i = sampler_blue_index(x, y, index, log2_samples, h);
  uint a = sampler_reverse_bits(sampler_laine_karras(i, sampler_hash(h ^ 0x68bc21ebu)));
  uint b = sampler_owen(sampler_sobol_y(i), sampler_hash(h ^ 0x02e5be93u));
  uint c = sampler_owen(sampler_sobol_z(i), sampler_hash(h ^ 0x967a889bu));
  return vec3(sampler_to_float(a), sampler_to_float(b), sampler_to_float(c));
}

HW_NAMESPACE_END
#endif
