// SPDX-License-Identifier: Apache-2.0
// GGX microfacets with Smith's height-correlated shadowing.
//
// Follows: Walter et al. 2007, "Microfacet models for refraction through rough surfaces"; Heitz 2014, "Understanding
// the masking-shadowing function"; Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps". Local
// frames have z along the shading normal, x along the tangent.
#ifndef HW_MICROFACET_H
#define HW_MICROFACET_H
#include "frame.h"
HW_NAMESPACE_BEGIN

// Distribution of normals. slope2 = (h.x/alpha_x)^2 + (h.y/alpha_y)^2. Written with the sine rather than 1 - cos^2,
// which cancels for smooth surfaces.
HW_FN float ggx_distribution(float slope2, float cos_h, float alpha_xy) {
  return 1.0f / (HW_PI * alpha_xy * square(slope2 + cos_h * cos_h));
}

// Smith's Lambda. alpha_tan2 = ((alpha_x v.x)^2 + (alpha_y v.y)^2) / v.z^2.
HW_FN float ggx_lambda(float alpha_tan2) { return 0.5f * (sqrt(1.0f + alpha_tan2) - 1.0f); }

// A normal with the density of those visible from `wo` (z > 0), both local: D G1 max(0, wo·h) / wo.z.
HW_FN vec3 ggx_sample_visible_normal(vec3 wo, float alpha_x, float alpha_y, vec2 u) {
  vec3 v = normalize(vec3(wo.x * alpha_x, wo.y * alpha_y, wo.z));
  // A point of the cap of directions that reflect v into the upper hemisphere, uniform; the half vector is the normal.
  float z = (1.0f - u.y) * (1.0f + v.z) - v.z;
  float r = safe_sqrt(1.0f - z * z);
  float phi = 2.0f * HW_PI * u.x;
  vec3 h = vec3(r * cos(phi), r * sin(phi), z) + v;
  return normalize(vec3(h.x * alpha_x, h.y * alpha_y, max(h.z, 1e-7f)));
}

// The direction that wo takes through a facet of normal h; cos_t as fresnel_dielectric gives it.
HW_FN vec3 refract_through(vec3 wo, vec3 h, float eta, float cos_t) {
  float inv = 1.0f / eta;
  float cos_i = dot(wo, h);
  return h * (inv * cos_i - (cos_i >= 0.0f ? cos_t : -cos_t)) - wo * inv;
}

HW_NAMESPACE_END
#endif
