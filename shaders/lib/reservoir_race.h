// SPDX-License-Identifier: Apache-2.0
// One reservoir fed by many threads at once, with a result that does not depend on their order. The winner is found by
// a race of exponential clocks (Efraimidis2006Reservoir): the least of -ln(1 - u_i) / w_i is i's with probability
// w_i / sum, and a minimum commutes (64-bit atomicMin). Weights are summed in fixed point, which commutes too (64-bit
// atomicAdd).
#ifndef HW_RESERVOIR_RACE_H
#define HW_RESERVOIR_RACE_H
#include "reservoir.h"
#include "sampler.h"
HW_NAMESPACE_BEGIN

// ---- The race

// The key of no candidate: what a race starts from. Every candidate with a usable weight has a lesser one.
HW_FN uint64_t race_none() { return (uint64_t(HW_NONE) << 32u) | uint64_t(HW_NONE); }

// -ln(1 - t) for t in [0, 1), relative error below 2e-6: a GPU's logarithm may be off by 2^-21 near one, which is all
// of the key of a winner among a million.
HW_FN float race_exponential(float t) {
  float s = t / (2.0f - t);
  float s2 = s * s;
  float series = 2.0f * s * (1.0f + s2 * (1.0f / 3.0f + s2 * (0.2f + s2 * (1.0f / 7.0f + s2 * (1.0f / 9.0f)))));
  return t < 0.25f ? series : -log(1.0f - t);
}

// Key of a candidate of weight w: an arrival time in the high word (positive floats order as integers), `id` in the
// low one. The least key wins. u in [0, 1), uniform and independent of those of the race's other candidates. id: tells
// them apart, so that there are no ties, and adds 24 bits below u's 24: without them a sixteenth of races among a
// million candidates would go to a u of 0 whatever its weight. w that is not usable gives race_none(). Scaling all
// weights by a power of two keeps the order, while w is between 2^-90 and 2^90.
HW_FN uint64_t race_key(float w, float u, uint id) {
  if (!reservoir_usable(w)) {
    return race_none();
  }
  float below = sampler_to_float(sampler_hash_combine(id, floatBitsToUint(u))) * 5.9604644775390625e-8f;
  float t = min((reservoir_usable(u) ? u : 0.0f) + below, 0.99999994f);
  float arrival = min(race_exponential(t) / w, HW_INFINITY);
  return (uint64_t(floatBitsToUint(arrival)) << 32u) | uint64_t(id);
}
HW_FN uint race_id(uint64_t key) { return uint(key & uint64_t(HW_NONE)); }

// ---- Fixed-point sums

// A sum has a scale, 2^exponent, of about the size of a typical term. One unit is 2^(exponent - 20): a term is rounded
// to the nearest unit, so below 2^(exponent - 21) it is lost, and saturates just below 2^(exponent + 20). So one term
// is right to 2^-20 of the scale, from a millionth of the scale to a million times it. 2^24 terms cannot overflow a
// sum, whatever they are. All by integers: every device gives the same bits, and all terms doubled under an exponent
// one higher give the same bits as before.
HW_CONST int HW_FIXED_FRACTION = 20;
HW_CONST int HW_FIXED_TERM_BITS = 40;

// The exponent for a scale: floor(log2(scale)), exactly; 0 for a scale that is not usable.
HW_FN int fixed_exponent(float scale) { return reservoir_usable(scale) ? int(floatBitsToUint(scale) >> 23u) - 127 : 0; }

// w in units, to be added to a sum. 0 for w that is not usable; exponent in [-300, 300].
HW_FN uint64_t fixed_from_float(float w, int exponent) {
  if (!reservoir_usable(w)) {
    return uint64_t(0u);
  }
  uint bits = floatBitsToUint(w);
  uint mantissa = (bits & 0x007FFFFFu) | 0x00800000u;
  int shift = int(bits >> 23u) - 150 - clamp(exponent, -300, 300) + HW_FIXED_FRACTION;  // w = mantissa 2^(... - 150)
  if (shift > HW_FIXED_TERM_BITS - 24) {
    return (uint64_t(1u) << uint(HW_FIXED_TERM_BITS)) - uint64_t(1u);
  }
  if (shift >= 0) {
    return uint64_t(mantissa) << uint(shift);
  }
  if (shift < -24) {
    return uint64_t(0u);
  }
  return uint64_t((mantissa + (1u << uint(-shift - 1))) >> uint(-shift));
}

// x 2^e, exactly but for denormal results, which may be 0.
HW_FN float fixed_scale(float x, int e) {
  int first = clamp(e / 2, -126, 127);
  int second = clamp(e - first, -126, 127);
  return x * uintBitsToFloat(uint(first + 127) << 23u) * uintBitsToFloat(uint(second + 127) << 23u);
}

// A sum of such terms as a float, rounded twice (relative error below 2^-23), at most HW_INFINITY.
HW_FN float fixed_to_float(uint64_t sum, int exponent) {
  float units = float(uint(sum >> 32u)) * 4294967296.0f + float(uint(sum & uint64_t(HW_NONE)));
  return min(fixed_scale(units, clamp(exponent, -300, 300) - HW_FIXED_FRACTION), HW_INFINITY);
}

HW_NAMESPACE_END
#endif
