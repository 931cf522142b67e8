// SPDX-License-Identifier: Apache-2.0
// Diffuse reflection of rough surfaces: Oren-Nayar in Fujii's form with the energy of multiple scattering added.
//
// Follows: Fujii, "A tiny improvement of Oren-Nayar reflectance model"; the multiple-scattering term of OpenPBR
// (Portsmouth, Kutz and Hill 2024, "EON: a practical energy-preserving rough diffuse BRDF"). Departure, as in Cycles:
// that term is multiplied by the closure's weight, hence by the colour, once more than in the paper.
#ifndef HW_OREN_NAYAR_H
#define HW_OREN_NAYAR_H
#include "frame.h"
HW_NAMESPACE_BEGIN

// The constant and the retro-reflective coefficient for a roughness in 0..1, both with the 1/pi.
HW_FN void oren_nayar_coefficients(float roughness, HW_OUT(float) a, HW_OUT(float) b) {
  a = 1.0f / (HW_PI + roughness * (0.5f * HW_PI - 2.0f / 3.0f));
  b = roughness * a;
}

// The integral of b's term over the other hemisphere, at cosine c.
HW_FN float oren_nayar_integral(float c) {
  float s = safe_sqrt(1.0f - c * c);
  float theta = acos(clamp(c, 0.0f, 1.0f));
  float exact = s * (theta - 2.0f / 3.0f - s * c) + (2.0f / 3.0f) * (s / max(c, 1e-6f)) * (1.0f - s * s * s);
  return c < 1e-6f ? (0.5f * HW_PI - 2.0f / 3.0f) - c : exact;
}

// What the multiple-scattering term is worth for the viewing cosine; (1 - albedo(light)) times this is the term.
HW_FN vec3 oren_nayar_multiscatter(float roughness, vec3 color, float cos_o) {
  float a, b;
  oren_nayar_coefficients(roughness, a, b);
  vec3 rho = saturate3(color);
  float mean = a * HW_PI + ((2.0f * HW_PI - 5.6f) / 3.0f) * b;  // mean of the single-scattering albedo (fit)
  float albedo_o = a * HW_PI + b * oren_nayar_integral(max(cos_o, 0.0f));
  return rho * rho * (HW_INV_PI * (mean / (1.0f - mean)) * (1.0f - albedo_o)) / (vec3(1.0f) - rho * (1.0f - mean));
}

// f·cos for unit weight.
HW_FN vec3 oren_nayar_eval(float roughness, vec3 multiscatter, vec3 N, vec3 wo, vec3 wi) {
  float a, b;
  oren_nayar_coefficients(roughness, a, b);
  float cos_i = max(dot(N, wi), 0.0f);
  float cos_o = max(dot(N, wo), 0.0f);
  float t = dot(wi, wo) - cos_i * cos_o;
  t = t > 0.0f ? t / max(max(cos_i, cos_o), 1e-20f) : t;
  float albedo_i = a * HW_PI + b * oren_nayar_integral(cos_i);
  return cos_i * (vec3(a + b * t) + multiscatter * (1.0f - albedo_i));
}

HW_NAMESPACE_END
#endif
