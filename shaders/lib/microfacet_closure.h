// SPDX-License-Identifier: Apache-2.0
// The microfacet closures: reflectance models, albedo, evaluation and sampling of Glossy, Refraction and Glass records.
//
// Follows Cycles 5.0's choices: reflection and refraction are chosen by their share of the reflectance of the sampled
// facet; facets below HW_SINGULAR_ALPHA2 are mirrors; albedos are those of lib/luts.h.
#ifndef HW_MICROFACET_CLOSURE_H
#define HW_MICROFACET_CLOSURE_H
#include "../shared/closure.h"
#include "../shared/features.h"
#include "fresnel.h"
#include "luts.h"
#include "microfacet.h"
HW_NAMESPACE_BEGIN

HW_CONST float HW_SINGULAR_ALPHA2 = 2e-10f;  // alpha_x alpha_y up to which a facet distribution is a mirror
HW_CONST float HW_SINGULAR_IOR = 1e-4f;      // |ior - 1| up to which refraction goes straight on

HW_FN uint closure_type(HW_IN(Closure) c) { return c.type & 0xFFu; }
HW_FN uint closure_fresnel(HW_IN(Closure) c) { return (c.type >> 8u) & 7u; }

HW_FN vec3 closure_color0(HW_IN(Closure) c) {
  return vec3(unpackHalf2x16(c.color0_rg), unpackHalf2x16(c.color0_b_color1_r).x);
}
HW_FN vec3 closure_color1(HW_IN(Closure) c) {
  return vec3(unpackHalf2x16(c.color0_b_color1_r).y, unpackHalf2x16(c.color1_gb));
}
HW_FN void closure_set_colors(HW_INOUT(Closure) c, vec3 color0, vec3 color1) {
  c.color0_rg = packHalf2x16(vec2(color0.x, color0.y));
  c.color0_b_color1_r = packHalf2x16(vec2(color0.z, color1.x));
  c.color1_gb = packHalf2x16(vec2(color1.y, color1.z));
}

HW_FN bool microfacet_is_singular(HW_IN(Closure) c) { return c.alpha_x * c.alpha_y <= HW_SINGULAR_ALPHA2; }
HW_FN bool microfacet_reflects(HW_IN(Closure) c) { return closure_type(c) != HW_CLOSURE_REFRACTION; }
HW_FN bool microfacet_transmits(HW_IN(Closure) c) { return closure_type(c) >= HW_CLOSURE_REFRACTION; }
HW_FN float microfacet_roughness(HW_IN(Closure) c) { return sqrt(sqrt(c.alpha_x * c.alpha_y)); }

HW_FN vec3 microfacet_reflect_tint(HW_IN(Closure) c) {
  vec3 tint = (c.type & HW_CLOSURE_REFLECT_TINT) != 0u ? closure_color1(c) : vec3(1.0f);
  return (c.type & HW_CLOSURE_NO_REFLECT) != 0u ? vec3(0.0f) : tint;
}

// What a facet seen at cosine cos_i reflects and transmits; cos_t as fresnel_dielectric gives it. `kind` is the
// closure's HW_FRESNEL_*: apart, so that a builder's constant leaves the other kinds out.
HW_FN void microfacet_fresnel(HW_IN(Closure) c, uint kind, float cos_i, HW_OUT(vec3) reflectance,
                              HW_OUT(vec3) transmittance, HW_OUT(float) cos_t) {
  float F = fresnel_dielectric(cos_i, c.ior, cos_t);
  bool schlick = kind == HW_FRESNEL_SCHLICK;
  vec3 color0 = closure_color0(c);
  vec3 R = schlick ? mix(color0, vec3(1.0f), fresnel_rise(F, c.ior)) : vec3(kind == HW_FRESNEL_NONE ? 1.0f : F);
  vec3 T = kind == HW_FRESNEL_NONE ? vec3(F >= 1.0f ? 0.0f : 1.0f) : vec3(1.0f) - R;
  if (HW_HAS(HW_FEATURE_METALLIC)) {
    if (kind == HW_FRESNEL_F82) R = fresnel_f82(cos_i, color0, closure_color1(c));
  }
  if (HW_HAS(HW_FEATURE_CONDUCTOR)) {
    if (kind == HW_FRESNEL_CONDUCTOR) R = fresnel_conductor(cos_i, color0, closure_color1(c));
  }
  if (HW_HAS(HW_FEATURE_TRANSMISSION)) {
    R = schlick ? R * microfacet_reflect_tint(c) : R;
    T = schlick ? T * closure_color1(c) : T;
    bool open = microfacet_transmits(c) && (c.type & HW_CLOSURE_NO_TRANSMIT) == 0u;
    reflectance = microfacet_reflects(c) ? R : vec3(0.0f);
    transmittance = open ? T : vec3(0.0f);
  } else {
    reflectance = R;
    transmittance = vec3(0.0f);
  }
}

// Share of a white environment that each lobe returns, without the closure's weight. As Cycles: tables for what they
// hold, otherwise as if the surface were smooth; the missing energy of rough facets is taken as restored.
// `kind` as above.
HW_FN void microfacet_albedo(HW_IN(Closure) c, uint kind, vec3 wo, HW_OUT(vec3) reflected, HW_OUT(vec3) transmitted) {
  float cos_o = dot(c.N, wo);
  float cos_t;
  microfacet_fresnel(c, kind, cos_o, reflected, transmitted, cos_t);
  float r = microfacet_roughness(c);
  float z = sqrt(abs((c.ior - 1.0f) / (c.ior + 1.0f)));
  vec3 smooth_albedo = reflected;
  bool from_ior = kind == HW_FRESNEL_SCHLICK || (kind == HW_FRESNEL_DIELECTRIC && c.ior > 1.0f);
  if (from_ior) {
    float rise = lut_3d(HW_LUT_RISE_IOR, 16u, r, cos_o, z);
    vec3 f0 = kind == HW_FRESNEL_SCHLICK ? closure_color0(c) : vec3(f0_from_ior(c.ior));
    reflected = mix(f0, vec3(1.0f), rise);
    if (HW_HAS(HW_FEATURE_TRANSMISSION)) {
      if (kind == HW_FRESNEL_SCHLICK) reflected = reflected * microfacet_reflect_tint(c);
    }
  }
  if (HW_HAS(HW_FEATURE_METALLIC)) {
    if (kind == HW_FRESNEL_F82) {
      reflected = mix(closure_color0(c), vec3(1.0f), lut_2d(HW_LUT_RISE_SCHLICK, 16u, r, cos_o));
    }
  }
  // Nothing reflected by a smooth surface: nothing at all.
  reflected = max3(smooth_albedo) > 0.0f ? reflected : vec3(0.0f);
}

// ((alpha_x v.x)^2 + (alpha_y v.y)^2) / v.z^2 for Smith's Lambda. Refraction is isotropic.
HW_FN float microfacet_alpha_tan2(HW_IN(Closure) c, vec3 x, vec3 y, vec3 v) {
  float cos_v = dot(c.N, v);
  if (HW_HAS(HW_FEATURE_ANISOTROPY)) {
    return (square(c.alpha_x * dot(x, v)) + square(c.alpha_y * dot(y, v))) / max(square(cos_v), 1e-20f);
  }
  vec3 s = cross(c.N, v);
  return c.alpha_x * c.alpha_y * dot(s, s) / max(square(cos_v), 1e-20f);
}

HW_FN void microfacet_frame(HW_IN(Closure) c, HW_OUT(vec3) x, HW_OUT(vec3) y) {
  if (HW_HAS(HW_FEATURE_ANISOTROPY)) {
    frame_from_tangent(c.N, octahedral_unpack(c.tangent), x, y);
  } else {
    warp_frame(c.N, x, y);
  }
}

// Whether refraction from wo to wi has a facet to go through: its normal, above the surface, must see wo from the front
// and wi from behind. Departure: Cycles does not ask, so lights sampled through open sheets of rough glass add light
// there that no sampled direction finds, and its image depends on the light sampling. Closed objects hide it (decision
// 0003).
HW_FN bool microfacet_refraction_exists(HW_IN(Closure) c, vec3 wo, vec3 wi) {
  vec3 h = c.ior * wi + wo;
  float up = dot(c.N, h);
  return up * dot(h, wo) > 0.0f && up * dot(h, wi) < 0.0f;
}

// f(wo, wi)|cos| and pdf without the closure's weight, by Walter et al. 2007: common factor D |wo·h| |dh/dwi| /
// (wo·n)...
HW_FN vec3 microfacet_eval(HW_IN(Closure) c, vec3 wo, vec3 wi, HW_OUT(float) pdf) {
  pdf = 0.0f;
  float cos_o = dot(c.N, wo);
  float cos_i = dot(c.N, wi);
  bool transmit = HW_HAS(HW_FEATURE_TRANSMISSION) && cos_i < 0.0f;
  bool possible = transmit ? microfacet_transmits(c) : (microfacet_reflects(c) && cos_i >= 0.0f);
  if (HW_HAS(HW_FEATURE_TRANSMISSION)) possible = possible && (!transmit || microfacet_refraction_exists(c, wo, wi));
  if (cos_o <= 0.0f || microfacet_is_singular(c) || !possible) return vec3(0.0f);

  vec3 h = transmit ? -(c.ior * wi + wo) : wi + wo;
  float h_length2 = dot(h, h);
  if (h_length2 < 1e-16f) return vec3(0.0f);
  float inv_length = inversesqrt(h_length2);
  h = h * inv_length;
  float cos_oh = dot(h, wo);

  vec3 R, T;
  float cos_t;
  microfacet_fresnel(c, closure_fresnel(c), cos_oh, R, T, cos_t);
  float mean_r = mean3(R);
  float mean_t = mean3(T);
  if (mean_r + mean_t <= 0.0f) return vec3(0.0f);

  float alpha_xy = c.alpha_x * c.alpha_y;
  float slope2;
  float tan2_o;
  float tan2_i;
  if (HW_HAS(HW_FEATURE_ANISOTROPY)) {
    vec3 x, y;
    microfacet_frame(c, x, y);
    slope2 = square(dot(x, h) / c.alpha_x) + square(dot(y, h) / c.alpha_y);
    tan2_o = microfacet_alpha_tan2(c, x, y, wo);
    tan2_i = microfacet_alpha_tan2(c, x, y, wi);
  } else {
    vec3 s = cross(c.N, h);
    slope2 = dot(s, s) / alpha_xy;
    tan2_o = microfacet_alpha_tan2(c, s, s, wo);
    tan2_i = microfacet_alpha_tan2(c, s, s, wi);
  }
  float lambda_o = ggx_lambda(tan2_o);
  float lambda_i = ggx_lambda(tan2_i);
  float jacobian = transmit ? square(c.ior * inv_length) * abs(cos_oh * dot(h, wi)) : 0.25f;
  float common_factor = ggx_distribution(slope2, dot(c.N, h), alpha_xy) / cos_o * jacobian;
  float reflect_share = mean_r / (mean_r + mean_t);
  pdf = common_factor * (transmit ? 1.0f - reflect_share : reflect_share) / (1.0f + lambda_o);
  return (transmit ? T : R) * (c.energy_scale * common_factor / (1.0f + lambda_o + lambda_i));
}

// u.xy picks the facet, u.z between reflection and refraction. Returns f|cos| and pdf as microfacet_eval does, or for a
// delta (label has SINGULAR) the factor of the delta and the probability of the lobe. HW_LABEL_NONE: nothing sampled.
HW_FN uint microfacet_sample(HW_IN(Closure) c, vec3 Ng, vec3 wo, vec3 u, HW_OUT(vec3) wi, HW_OUT(vec3) value,
                             HW_OUT(float) pdf) {
  wi = c.N;
  value = vec3(0.0f);
  pdf = 0.0f;
  float cos_o = dot(c.N, wo);
  if (cos_o <= 0.0f) return HW_LABEL_NONE;

  bool singular = microfacet_is_singular(c);
  vec3 x, y;
  microfacet_frame(c, x, y);
  vec3 local_o = vec3(dot(x, wo), dot(y, wo), cos_o);
  vec3 local_h = vec3(0.0f, 0.0f, 1.0f);
  if (!singular) local_h = ggx_sample_visible_normal(local_o, c.alpha_x, c.alpha_y, vec2(u.x, u.y));
  vec3 h = singular ? c.N : local_h.x * x + local_h.y * y + local_h.z * c.N;
  float cos_oh = dot(h, wo);

  vec3 R, T;
  float cos_t;
  microfacet_fresnel(c, closure_fresnel(c), cos_oh, R, T, cos_t);
  float mean_r = mean3(R);
  float mean_t = mean3(T);
  if (mean_r + mean_t <= 0.0f) return HW_LABEL_NONE;
  float reflect_share = mean_r / (mean_r + mean_t);
  bool transmit = HW_HAS(HW_FEATURE_TRANSMISSION) && u.z >= reflect_share;

  wi = transmit ? refract_through(wo, h, c.ior, cos_t) : 2.0f * cos_oh * h - wo;
  wi = normalize(wi);
  float cos_i = dot(c.N, wi);
  // On its own side of both normals.
  if ((dot(Ng, wi) < 0.0f) != transmit || (cos_i < 0.0f) != transmit) return HW_LABEL_NONE;

  value = transmit ? T : R;
  pdf = transmit ? 1.0f - reflect_share : reflect_share;
  singular = singular || (transmit && abs(c.ior - 1.0f) < HW_SINGULAR_IOR);
  if (!singular) {
    float alpha_xy = c.alpha_x * c.alpha_y;
    float slope2 = square(local_h.x / c.alpha_x) + square(local_h.y / c.alpha_y);
    float tan2_o = (square(c.alpha_x * local_o.x) + square(c.alpha_y * local_o.y)) / max(square(cos_o), 1e-20f);
    float lambda_o = ggx_lambda(tan2_o);
    float lambda_i = ggx_lambda(microfacet_alpha_tan2(c, x, y, wi));
    // |wo·h| |wi·h| / (wi·h + (wo·h)/ior)^2 with |wi·h| = cos_t.
    float jacobian = transmit ? abs(cos_oh * cos_t) / max(square(cos_oh / c.ior - cos_t), 1e-20f) : 0.25f;
    float common_factor = ggx_distribution(slope2, local_h.z, alpha_xy) / cos_o * jacobian;
    pdf = pdf * common_factor / (1.0f + lambda_o);
    value = value * (common_factor / (1.0f + lambda_o + lambda_i));
  }
  value = value * c.energy_scale;
  return (transmit ? HW_LABEL_TRANSMIT : HW_LABEL_REFLECT) | (singular ? HW_LABEL_SINGULAR : HW_LABEL_GLOSSY);
}

HW_NAMESPACE_END
#endif
