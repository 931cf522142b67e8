// SPDX-License-Identifier: Apache-2.0
// Reservoirs (shared/reservoir.h): a stream of weighted candidates of which one is kept (weighted reservoir sampling,
// SivaramWSSR, Algorithm 1; Bitterli2020ReSTIR), and the MIS weights that make merging unbiased (Lin2022GRIS). What
// many threads do to one reservoir at once stands in lib/reservoir_race.h.
//
// Departures from the paper's Algorithm 1:
//  - MERGE weighs by p_hat(z) W c with W = sum / (c p_hat_Q(z)), not by p_hat(z) w_sum M as printed: so printed, twice
//    the emission gives four times the radiance;
//  - weights may carry MIS weights m_i instead of the 1/M, which is biased where surfaces differ;
//  - a weight that is not a positive number adds its confidence and nothing else.
#ifndef HW_RESERVOIR_H
#define HW_RESERVOIR_H
#include "../shared/reservoir.h"
HW_NAMESPACE_BEGIN

// Whether w is a normal positive float: not 0, negative, denormal (devices differ in them), infinite or NaN. By bits:
// GLSL does not promise that comparisons see NaN.
HW_FN bool reservoir_usable(float w) { return floatBitsToUint(w) - 0x00800000u < 0x7F000000u; }

HW_FN Reservoir reservoir_empty(float confidence) {
  Reservoir r;
  r.light = HW_NONE;
  r.u = 0.0f;
  r.v = 0.0f;
  r.weight = 0.0f;
  r.confidence = confidence;
  r.target = 0.0f;
  return r;
}

// The reservoir of a chosen sample: W = (sum / p_hat) / count, with the sum of all resampling weights, the winner among
// them. Empty, but with its confidence, if any of the three is no positive number.
HW_FN Reservoir reservoir_make(uint light, float u, float v, float target, float sum, float count, float confidence) {
  Reservoir r = reservoir_empty(confidence);
  float weight = sum / target / count;
  if (light != HW_NONE && reservoir_usable(sum) && reservoir_usable(target) && reservoir_usable(count) &&
      reservoir_usable(weight)) {
    r.light = light;
    r.u = u;
    r.v = v;
    r.weight = weight;
    r.target = target;
  }
  return r;
}

// Limits how much history a reservoir stands for: min(c, cap). Keeps the expected value where confidences do not depend
// on sample values.
HW_FN Reservoir reservoir_capped(Reservoir r, float cap) {
  r.confidence = min(r.confidence, cap);
  return r;
}

// ---- Streams

struct ReservoirStream {
  uint light;  // of the candidate kept so far; HW_NONE: none
  float u;
  float v;
  float target;      // p_hat of that candidate, at the surface the stream is for
  float sum;         // of weights; finite
  float confidence;  // sum of confidences; finite
};

HW_FN ReservoirStream stream_begin() {
  ReservoirStream s;
  s.light = HW_NONE;
  s.u = 0.0f;
  s.v = 0.0f;
  s.target = 0.0f;
  s.sum = 0.0f;
  s.confidence = 0.0f;
  return s;
}

// Offers a candidate: it replaces the one kept with probability weight / (sum with it), and then true is returned.
// weight: m_i p_hat(x) W (m_i may be left out, see the ends below), target: p_hat(x) at this stream's surface,
// confidence: what the candidate stands for, u_random in [0, 1). Neither sum passes the largest float. A weight or a
// target that is not usable, or no light, adds the confidence alone.
HW_FN bool stream_add(HW_INOUT(ReservoirStream) s, uint light, float u, float v, float weight, float target,
                      float confidence, float u_random) {
  if (reservoir_usable(confidence)) {
    s.confidence = min(s.confidence + confidence, HW_INFINITY);
  }
  if (light == HW_NONE || !reservoir_usable(weight) || !reservoir_usable(target)) {
    return false;
  }
  s.sum = min(s.sum + weight, HW_INFINITY);
  if (s.light != HW_NONE && u_random * s.sum >= weight) {
    return false;
  }
  s.light = light;
  s.u = u;
  s.v = v;
  s.target = target;
  return true;
}

// Weight with which another reservoir's sample enters a stream, its MIS weight apart: p_hat(x) W, where `target` is
// p_hat of r's sample at the stream's surface. For 1/M and 1/Z, multiply by r.confidence.
HW_FN float stream_weight(Reservoir r, float target) {
  return r.light != HW_NONE ? min(target * r.weight, HW_INFINITY) : 0.0f;
}

// The end of a stream whose weights carry their m_i, which sum to one: W = sum / p_hat.
HW_FN Reservoir stream_end_mis(ReservoirStream s) {
  return reservoir_make(s.light, s.u, s.v, s.target, s.sum, 1.0f, s.confidence);
}
// Of one whose weights carry confidences instead, by 1/M: W = sum / (M p_hat) with M the sum of confidences. Biased
// (dark) where a candidate comes from a surface whose p_hat is zero in places where this one's is not.
HW_FN Reservoir stream_end_count(ReservoirStream s) {
  return reservoir_make(s.light, s.u, s.v, s.target, s.sum, s.confidence, s.confidence);
}
// By 1/Z: `support` is the sum of the confidences of those surfaces at which p_hat of the chosen sample is positive.
// Unbiased, but noisy where such a p_hat is small.
HW_FN Reservoir stream_end_support(ReservoirStream s, float support) {
  return reservoir_make(s.light, s.u, s.v, s.target, s.sum, support, s.confidence);
}

// ---- MIS weights. c: confidences, p: p_hat of one sample x at each surface.

// a / (a + b), with neither overflow nor 0 / 0. What is no positive normal number or +infinity counts as zero; 0 where
// a does.
HW_FN float mis_share(float a, float b) {
  if (floatBitsToUint(a) - 0x00800000u > 0x7F000000u) {
    return 0.0f;
  }
  if (floatBitsToUint(b) - 0x00800000u > 0x7F000000u) {
    return 1.0f;
  }
  a = min(a, HW_INFINITY);
  b = min(b, HW_INFINITY);
  float r = min(a, b) / max(a, b);
  return (a < b ? r : 1.0f) / (1.0f + r);
}

// Balance: m_i = c_i p_i(x) / sum_j c_j p_j(x), with `others` the same sum without i.
HW_FN float mis_balance(float c_i, float p_i, float others) { return mis_share(c_i * p_i, others); }

// Defensive pairwise MIS (Bitterli2022Thesis; Lin2022GRIS, section 7): of a canonical sample (1) that can be anything
// where p_1 > 0 and others (i), with C the sum of all confidences, c_1 among them.
//   m_i = (c_i / C) Cbar p_i / (Cbar p_i + c_1 p_1),  Cbar = C - c_1
//   m_1 = c_1 / C + sum over i != 1 of (c_i / C) c_1 p_1 / (c_1 p_1 + Cbar p_i)
// They sum to one wherever p_1 > 0. An empty reservoir with a confidence takes part in m_1 like any other; its surface
// has a p_hat too.
//
// m_i of sample i; p_i, p_1 at its x.
HW_FN float mis_pairwise(float c_i, float c_1, float c_all, float p_i, float p_1) {
  return c_all > 0.0f ? c_i / c_all * mis_share(max(c_all - c_1, 0.0f) * p_i, c_1 * p_1) : 0.0f;
}
// The term of m_1 for reservoir i; p_i, p_1 at the canonical x.
HW_FN float mis_pairwise_canonical(float c_i, float c_1, float c_all, float p_i, float p_1) {
  return c_all > 0.0f ? c_i / c_all * mis_share(c_1 * p_1, max(c_all - c_1, 0.0f) * p_i) : 0.0f;
}
// The term of m_1 that belongs to no other: c_1 / C; 1 if nothing has a confidence.
HW_FN float mis_pairwise_base(float c_1, float c_all) { return c_all > 0.0f ? c_1 / c_all : 1.0f; }

HW_NAMESPACE_END
#endif
