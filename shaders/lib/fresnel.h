// SPDX-License-Identifier: Apache-2.0
// Fresnel reflectance of dielectrics and metals, exact and artistic, and their means over the hemisphere.
//
// Follows: Walter et al. 2007 (dielectric); Kutz et al. 2021, "Novel aspects of the Adobe Standard Material" (F82
// tint); Kulla and Conty 2017, "Revisiting physically based shading at Imageworks" (fits of the mean). All cosines are
// against the microfacet's normal; `eta` is the index on the far side over that on the viewer's side.
#ifndef HW_FRESNEL_H
#define HW_FRESNEL_H
#include "frame.h"
HW_NAMESPACE_BEGIN

// Unpolarised reflectance of a dielectric. cos_t is the cosine of the refracted ray, on its own side (>= 0; 0 where all
// is reflected). Symmetric in the sign of cos_i.
HW_FN float fresnel_dielectric(float cos_i, float eta, HW_OUT(float) cos_t) {
  float c = abs(cos_i);
  float eta_cos_t2 = eta * eta - (1.0f - c * c);
  float eta_cos_t = safe_sqrt(eta_cos_t2);
  cos_t = eta_cos_t / eta;
  // Amplitudes across and along the plane of incidence, both with the refracted cosine expressed through eta_cos_t.
  float s = (c - eta_cos_t) / max(c + eta_cos_t, 1e-20f);
  float p = (eta * c - cos_t) / max(eta * c + cos_t, 1e-20f);
  return eta_cos_t2 <= 0.0f ? 1.0f : 0.5f * (s * s + p * p);
}

HW_FN float f0_from_ior(float ior) { return square((ior - 1.0f) / (ior + 1.0f)); }
HW_FN float ior_from_f0(float f0) {
  float r = sqrt(clamp(f0, 0.0f, 0.99f));
  return (1.0f + r) / (1.0f - r);
}

// How far a dielectric's reflectance F has risen from its value at normal incidence (0) to 1.
HW_FN float fresnel_rise(float F, float ior) {
  float f0 = f0_from_ior(ior);
  return saturate((F - f0) / max(1.0f - f0, 1e-20f));
}

// Mean of the dielectric's reflectance over the cosine-weighted hemisphere (fit).
HW_FN float fresnel_dielectric_mean(float eta) {
  float above = (eta - 1.0f) / (4.08567f + 1.00071f * eta);
  float below = 0.997118f + eta * (0.1014f - eta * (0.965241f + eta * 0.130607f));
  return eta < 1.0f ? below : above;
}

HW_FN float power5(float x) {
  float x2 = x * x;
  return x2 * x2 * x;
}

// F82: Schlick less b·c·(1-c)^6, which is largest at c = 1/7, 81.8 degrees. There Schlick's value is
// f0 + (1-f0)(6/7)^5 and the term is b (1/7)(6/7)^6: b follows from the value wanted at that angle.
HW_FN vec3 f82_edge(vec3 f0, vec3 f82) {
  float q5 = power5(6.0f / 7.0f);
  return (mix(f0, vec3(1.0f), q5) - f82) * (7.0f / (q5 * (6.0f / 7.0f)));
}
// b from a tint, the factor on Schlick's value at that angle.
HW_FN vec3 f82_edge_from_tint(vec3 f0, vec3 tint) {
  return f82_edge(f0, mix(f0, vec3(1.0f), power5(6.0f / 7.0f)) * tint);
}
HW_FN vec3 fresnel_f82(float cos_i, vec3 f0, vec3 b) {
  float s = saturate(1.0f - cos_i);
  float s5 = power5(s);
  return saturate3(mix(f0, vec3(1.0f), s5) - b * (cos_i * s5 * s));
}
// Its mean, 2 integral F c dc: the Schlick term gives 1/21, the edge term 2 B(3, 7) = 1/126.
HW_FN vec3 fresnel_f82_mean(vec3 f0, vec3 b) { return mix(f0, vec3(1.0f), 1.0f / 21.0f) - b * (1.0f / 126.0f); }

// Reflectance of a conductor of complex index n + ik, in air. With n_t = n + ik and the refracted normal component
// (u + iv)^2 = n_t^2 - sin^2: R_s = |c - u - iv|^2 / |c + u + iv|^2, R_p = |n_t^2 c - (u + iv)|^2 / |n_t^2 c + (u +
// iv)|^2.
HW_FN vec3 fresnel_conductor(float cos_i, vec3 n, vec3 k) {
  float c = saturate(cos_i);
  vec3 re = n * n - k * k;
  vec3 im = 2.0f * n * k;
  vec3 a = re - (1.0f - c * c);
  vec3 modulus = sqrt(a * a + im * im);
  vec3 u2 = max(0.5f * (modulus + a), vec3(0.0f));
  vec3 v2 = max(0.5f * (modulus - a), vec3(0.0f));
  vec3 u = sqrt(u2);
  vec3 v = sqrt(v2);
  vec3 tiny = vec3(1e-20f);
  vec3 s_minus = vec3(c) - u;
  vec3 s_plus = vec3(c) + u;
  vec3 rs = (s_minus * s_minus + v2) / max(s_plus * s_plus + v2, tiny);
  vec3 p1 = re * c - u;
  vec3 p2 = im * c - v;
  vec3 p3 = re * c + u;
  vec3 p4 = im * c + v;
  vec3 rp = (p1 * p1 + p2 * p2) / max(p3 * p3 + p4 * p4, tiny);
  return 0.5f * (rs + rp);
}
// Mean by the F82 model that agrees with it at normal incidence and at 81.8 degrees.
HW_FN vec3 fresnel_conductor_mean(vec3 n, vec3 k) {
  vec3 f0 = fresnel_conductor(1.0f, n, k);
  return saturate3(fresnel_f82_mean(f0, f82_edge(f0, fresnel_conductor(1.0f / 7.0f, n, k))));
}

HW_NAMESPACE_END
#endif
