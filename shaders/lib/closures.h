// SPDX-License-Identifier: Apache-2.0
// Closures, evaluated and sampled: first one record, then a list of them under one-sample MIS (Veach 1997, balance
// heuristic over the closures' sample weights).
//
// Directions point away from the surface. "f" includes the cosine and the closure's weight. As in Cycles 5.0,
// evaluation lets light reach any direction above the shading normal (checked against the interpolated normal where a
// bump or normal map turned it), while sampling also asks that the direction lies on its side of the geometric normal.
#ifndef HW_CLOSURES_H
#define HW_CLOSURES_H
#include "closure_list.h"
#include "microfacet_closure.h"
#include "oren_nayar.h"
#include "sheen.h"
#include "toon.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_LOBE_DIFFUSE = 0u;
HW_CONST uint HW_LOBE_GLOSSY = 1u;
HW_CONST uint HW_LOBE_TRANSMISSION = 2u;

struct ClosureValue {
  vec3 f;     // weight · f · |cos|, 1/sr; for a delta the factor of the delta
  float pdf;  // 1/sr; for a delta the probability of the lobe
  uint lobe;  // which pass and light-exclusion family it counts as: translucency is DIFFUSE
  vec3 even;  // part of f that is the same from wherever the surface is seen
};

HW_FN bool closure_is_diffuse(HW_IN(Closure) c) {
  return closure_type(c) >= HW_CLOSURE_DIFFUSE && closure_type(c) <= HW_CLOSURE_TRANSLUCENT;
}
HW_FN bool closure_is_microfacet(HW_IN(Closure) c) {
  uint t = closure_type(c);
  return t == HW_CLOSURE_GLOSSY || t == HW_CLOSURE_REFRACTION || t == HW_CLOSURE_GLASS;
}

// A sample of it is labelled DIFFUSE | REFLECT.
HW_FN bool closure_reflects_diffusely(HW_IN(Closure) c) {
  return closure_is_diffuse(c) && closure_type(c) != HW_CLOSURE_TRANSLUCENT;
}

// Whether light may pass through to the viewer's side, perfectly or not.
HW_FN bool closure_lets_through(HW_IN(Closure) c) {
  uint t = closure_type(c);
  return t == HW_CLOSURE_TRANSLUCENT || t == HW_CLOSURE_REFRACTION || t == HW_CLOSURE_GLASS;
}

// Nothing to evaluate for a light sample: mirrors, perfect glass, transparency.
HW_FN bool closure_is_singular(HW_IN(Closure) c) {
  uint t = closure_type(c);
  return t == HW_CLOSURE_TRANSPARENT || t == HW_CLOSURE_NONE || (closure_is_microfacet(c) && microfacet_is_singular(c));
}

// alpha_x alpha_y: 0 for transparency, 1 for what has no such roughness.
HW_FN float closure_roughness2(HW_IN(Closure) c) {
  if (closure_type(c) == HW_CLOSURE_TRANSPARENT) return 0.0f;
  return closure_is_microfacet(c) ? c.alpha_x * c.alpha_y : 1.0f;
}

// Filter Glossy: alpha is raised to at least `alpha` (the integrator's sqrt(1 - filter · min_pdf) / 2).
HW_FN void closure_blur(HW_INOUT(Closure) c, float alpha) {
  if (closure_is_microfacet(c)) {
    c.alpha_x = max(c.alpha_x, alpha);
    c.alpha_y = max(c.alpha_y, alpha);
  }
}

// For a closure whose normal is not the interpolated one, what is left of direction w. 0 where w is on the wrong side
// of the smooth surface; for diffuse closures a softened terminator (Conty Estevez, Lecocq and Stein 2019, "A
// microfacet-based shadowing function to solve the bump terminator problem"). hard: 0 for the sampled direction of a
// glossy closure.
HW_FN float closure_bump_factor(HW_IN(Closure) c, vec3 Ns, vec3 w, bool hard) {
  if (!HW_HAS(HW_FEATURE_BUMP)) return 1.0f;
  if ((c.type & HW_CLOSURE_BUMPED) == 0u) return 1.0f;
  float cos_sw = dot(Ns, w);
  float cos_sn = dot(Ns, c.N);
  bool diffuse = closure_is_diffuse(c);
  bool leak = cos_sw * cos_sn * dot(c.N, w) < 0.0f && (hard || diffuse);
  bool soften = diffuse && (c.type & HW_CLOSURE_BUMP_CORRECTION) != 0u && abs(cos_sn) < 1.0f && abs(cos_sw) < 1.0f;
  // Smith's G1 of a GGX surface as rough as the tilt of the normal.
  float tan2_n = 1.0f / max(cos_sn * cos_sn, 1e-12f) - 1.0f;
  float tan2_w = max(1.0f / max(cos_sw * cos_sw, 1e-12f) - 1.0f, 0.0f);
  float g = 1.0f / (1.0f + ggx_lambda(saturate(0.125f * tan2_n) * tan2_w));
  g = abs(cos_sw) < 1e-6f ? 0.0f : g;
  return leak ? 0.0f : (soften ? g : 1.0f);
}

// Of f: what is left of it without the layers above, which leave less the flatter the surface is seen.
HW_FN vec3 closure_even(HW_IN(Closure) c, vec3 f) {
  if (!HW_PATH_REUSE) return vec3(0.0f);
  bool even = closure_type(c) == HW_CLOSURE_DIFFUSE && c.alpha_x > 0.0f;
  return even ? f / c.alpha_x : vec3(0.0f);
}

HW_FN vec3 closure_mirror(HW_IN(Closure) c, vec3 wo) { return 2.0f * dot(c.N, wo) * c.N - wo; }

// One closure for a pair of directions. Deltas give 0.
HW_FN ClosureValue closure_eval(HW_IN(Closure) c, HW_IN(ShadingGeometry) g, vec3 wi) {
  ClosureValue v;
  uint t = closure_type(c);
  float cos_i = dot(c.N, wi);
  // Diffuse and translucent: cos/pi on one side or the other.
  float side = cos_i;
  if (HW_HAS(HW_FEATURE_TRANSLUCENT)) side = t == HW_CLOSURE_TRANSLUCENT ? -cos_i : cos_i;
  v.pdf = closure_is_diffuse(c) ? max(side, 0.0f) * HW_INV_PI : 0.0f;
  v.f = vec3(v.pdf);
  v.lobe = HW_LOBE_DIFFUSE;
  if (HW_HAS(HW_FEATURE_ROUGH_DIFFUSE)) {
    if (t == HW_CLOSURE_OREN_NAYAR) v.f = oren_nayar_eval(c.alpha_x, closure_color0(c), c.N, g.wo, wi);
  }
  if (HW_HAS(HW_FEATURE_SHEEN)) {
    if (t == HW_CLOSURE_SHEEN) {
      v.pdf = sheen_density(c.alpha_x, c.alpha_y, c.N, g.wo, wi);
      v.f = vec3(v.pdf);
    }
  }
  if (HW_HAS(HW_FEATURE_TOON)) {
    if (t == HW_CLOSURE_DIFFUSE_TOON || t == HW_CLOSURE_GLOSSY_TOON) {
      bool glossy = t == HW_CLOSURE_GLOSSY_TOON;
      float cos_axis = glossy ? dot(closure_mirror(c, g.wo), wi) : cos_i;
      bool above = cos_i >= 0.0f && (!glossy || dot(c.N, g.wo) > 0.0f);
      v.pdf = above ? toon_pdf(c.alpha_x, c.alpha_y, cos_axis) : 0.0f;
      v.f = vec3(v.pdf * toon_intensity(c.alpha_x, c.alpha_y, cos_axis));
      v.lobe = glossy ? HW_LOBE_GLOSSY : HW_LOBE_DIFFUSE;
    }
  }
  if (HW_HAS(HW_FEATURE_MICROFACET)) {
    if (closure_is_microfacet(c)) {
      v.f = microfacet_eval(c, g.wo, wi, v.pdf);
      v.lobe =
          t == HW_CLOSURE_GLOSSY || (t == HW_CLOSURE_GLASS && cos_i > 0.0f) ? HW_LOBE_GLOSSY : HW_LOBE_TRANSMISSION;
    }
  }
  float bump = closure_bump_factor(c, g.Ns, wi, true);
  v.pdf = bump == 0.0f ? 0.0f : v.pdf;
  v.f = v.f * c.weight * bump;
  v.even = closure_even(c, v.f);
  return v;
}

// A direction from one closure. Returns its label; HW_LABEL_NONE: none. u.z chooses the lobe of glass.
HW_FN uint closure_sample(HW_IN(Closure) c, HW_IN(ShadingGeometry) g, vec3 u, HW_OUT(vec3) wi, HW_OUT(ClosureValue) v) {
  uint t = closure_type(c);
  vec3 x, y;
  warp_frame(c.N, x, y);
  vec3 d = square_to_cosine_hemisphere(vec2(u.x, u.y));
  bool translucent = HW_HAS(HW_FEATURE_TRANSLUCENT) && t == HW_CLOSURE_TRANSLUCENT;
  wi = d.x * x + d.y * y + (translucent ? -d.z : d.z) * c.N;
  v.pdf = closure_is_diffuse(c) ? d.z * HW_INV_PI : 0.0f;
  v.f = vec3(v.pdf);
  v.lobe = HW_LOBE_DIFFUSE;
  uint label = (translucent ? HW_LABEL_TRANSMIT : HW_LABEL_REFLECT) | HW_LABEL_DIFFUSE;
  if (HW_HAS(HW_FEATURE_ROUGH_DIFFUSE)) {
    if (t == HW_CLOSURE_OREN_NAYAR) v.f = oren_nayar_eval(c.alpha_x, closure_color0(c), c.N, g.wo, wi);
  }
  if (HW_HAS(HW_FEATURE_SHEEN)) {
    if (t == HW_CLOSURE_SHEEN) {
      wi = sheen_sample(c.alpha_x, c.alpha_y, c.N, g.wo, vec2(u.x, u.y));
      v.pdf = sheen_density(c.alpha_x, c.alpha_y, c.N, g.wo, wi);
      v.f = vec3(v.pdf);
    }
  }
  if (HW_HAS(HW_FEATURE_TOON)) {
    if (t == HW_CLOSURE_DIFFUSE_TOON || t == HW_CLOSURE_GLOSSY_TOON) {
      bool glossy = t == HW_CLOSURE_GLOSSY_TOON;
      float height = toon_cone_height(toon_cone(c.alpha_x, c.alpha_y));
      float one_minus_cos;
      wi = warp_cone(glossy ? closure_mirror(c, g.wo) : c.N, height, vec2(u.x, u.y), one_minus_cos);
      bool above = !glossy || (dot(c.N, g.wo) > 0.0f && dot(c.N, wi) > 0.0f);
      v.pdf = above ? 1.0f / (2.0f * HW_PI * height) : 0.0f;
      v.f = vec3(v.pdf * toon_intensity(c.alpha_x, c.alpha_y, 1.0f - one_minus_cos));
      v.lobe = glossy ? HW_LOBE_GLOSSY : HW_LOBE_DIFFUSE;
      label = HW_LABEL_REFLECT | (glossy ? HW_LABEL_GLOSSY : HW_LABEL_DIFFUSE);
    }
  }
  // All so far: on its own side of the geometric normal.
  bool wrong_side = (dot(g.Ng, wi) > 0.0f) == translucent;
  v.pdf = wrong_side ? 0.0f : v.pdf;
  if (HW_HAS(HW_FEATURE_MICROFACET)) {
    if (closure_is_microfacet(c)) {
      label = microfacet_sample(c, g.Ng, g.wo, u, wi, v.f, v.pdf);
      v.lobe = t == HW_CLOSURE_GLOSSY || (t == HW_CLOSURE_GLASS && dot(c.N, wi) > 0.0f) ? HW_LOBE_GLOSSY
                                                                                        : HW_LOBE_TRANSMISSION;
    }
  }
  if (HW_HAS(HW_FEATURE_TRANSPARENT)) {
    if (t == HW_CLOSURE_TRANSPARENT) {
      wi = -g.wo;
      v.pdf = 1.0f;
      v.f = vec3(1.0f);
      v.lobe = HW_LOBE_TRANSMISSION;
      label = HW_LABEL_TRANSMIT | HW_LABEL_TRANSPARENT;
    }
  }
  float bump = (label & HW_LABEL_TRANSMIT) != 0u ? 1.0f : closure_bump_factor(c, g.Ns, wi, false);
  v.f = v.f * c.weight * bump;
  v.even = closure_even(c, v.f);
  return v.pdf > 0.0f ? label : HW_LABEL_NONE;
}

// Expected share of a white environment that the closure returns (weight included): Cycles' colour and denoising-albedo
// passes. Glass contributes to both the glossy and the transmission colour, each with its lobe.
HW_FN vec3 closure_albedo(HW_IN(Closure) c, vec3 wo, bool reflection, bool transmission) {
  vec3 share = vec3(1.0f);
  if (HW_HAS(HW_FEATURE_MICROFACET)) {
    if (closure_is_microfacet(c)) {
      vec3 R, T;
      microfacet_albedo(c, closure_fresnel(c), wo, R, T);
      share = (reflection ? R : vec3(0.0f)) + (transmission ? T : vec3(0.0f));
    }
  }
  return c.weight * share;
}

// The list -----------------------------------------------------------------------------------------------------------

HW_FN BsdfValue bsdf_value_none() {
  BsdfValue v;
  v.diffuse = vec3(0.0f);
  v.glossy = vec3(0.0f);
  v.transmission = vec3(0.0f);
  v.pdf = 0.0f;
  v.even = vec3(0.0f);
  v.diffuse_pdf = 0.0f;
  v.glossy_pdf = 0.0f;
  return v;
}

HW_FN void bsdf_value_add(HW_INOUT(BsdfValue) sum, HW_IN(ClosureValue) v) {
  if (v.lobe == HW_LOBE_DIFFUSE) sum.diffuse += v.f;
  if (v.lobe == HW_LOBE_GLOSSY) sum.glossy += v.f;
  if (v.lobe == HW_LOBE_TRANSMISSION) sum.transmission += v.f;
  if (HW_PATH_REUSE) sum.even += v.even;
}

HW_FN vec3 bsdf_value_total(HW_IN(BsdfValue) v) { return v.diffuse + v.glossy + v.transmission; }

// All closures for light from wi.
HW_FN BsdfValue closures_eval(HW_IN(ClosureList) list, HW_IN(ShadingGeometry) g, vec3 wi) {
  BsdfValue sum = bsdf_value_none();
  float weights = 0.0f;
  for (uint i = 0u; i < list.count; ++i) {
    Closure c = closure_load(list, i);
    ClosureValue v = closure_eval(c, g, wi);
    if (v.pdf > 0.0f) bsdf_value_add(sum, v);
    sum.pdf += v.pdf * c.sample_weight;
    if (HW_PATH_REUSE) {
      sum.diffuse_pdf += closure_reflects_diffusely(c) ? v.pdf * c.sample_weight : 0.0f;
      sum.glossy_pdf += v.lobe == HW_LOBE_GLOSSY ? v.pdf * c.sample_weight : 0.0f;
    }
    weights += c.sample_weight;
  }
  sum.pdf = weights > 0.0f ? sum.pdf / weights : 0.0f;
  sum.diffuse_pdf = weights > 0.0f ? sum.diffuse_pdf / weights : 0.0f;
  sum.glossy_pdf = weights > 0.0f ? sum.glossy_pdf / weights : 0.0f;
  return sum;
}

// A direction. u.z chooses the closure and is then used again; u.xy choose within it. HW_LABEL_NONE: the path ends.
// A delta's value is its factor and its pdf the probability of the choice: the other closures are left to other
// samples.
HW_FN BsdfSample closures_sample(HW_IN(ClosureList) list, HW_IN(ShadingGeometry) g, vec3 u) {
  BsdfSample s;
  s.wi = g.Ng;
  s.value = bsdf_value_none();
  s.label = HW_LABEL_NONE;
  s.roughness = 0.0f;
  s.eta = 1.0f;

  float weights = 0.0f;
  for (uint i = 0u; i < list.count; ++i) weights += closure_sample_weight(list, i);
  if (!(weights > 0.0f)) return s;

  // The last closure whose interval starts at or below the target.
  float target = u.z * weights;
  float start = 0.0f;
  float chosen_start = 0.0f;
  uint chosen = 0u;
  for (uint i = 0u; i < list.count; ++i) {
    float w = closure_sample_weight(list, i);
    if (target >= start && w > 0.0f) {
      chosen = i;
      chosen_start = start;
    }
    start += w;
  }

  Closure c = closure_load(list, chosen);
  vec3 u_closure = vec3(u.x, u.y, min((target - chosen_start) / c.sample_weight, 0.99999994f));
  ClosureValue v;
  s.label = closure_sample(c, g, u_closure, s.wi, v);
  if (s.label == HW_LABEL_NONE) return s;

  bsdf_value_add(s.value, v);
  s.value.pdf = v.pdf * c.sample_weight;
  s.roughness = sqrt(closure_roughness2(c));
  bool crosses = (s.label & HW_LABEL_TRANSMIT) != 0u && closure_is_microfacet(c);
  s.eta = crosses ? c.ior : 1.0f;
  if ((s.label & (HW_LABEL_SINGULAR | HW_LABEL_TRANSPARENT)) == 0u) {
    for (uint i = 0u; i < list.count; ++i) {
      if (i != chosen) {
        Closure other = closure_load(list, i);
        ClosureValue w = closure_eval(other, g, s.wi);
        if (w.pdf > 0.0f) bsdf_value_add(s.value, w);
        s.value.pdf += w.pdf * other.sample_weight;
      }
    }
  }
  s.value.pdf = s.value.pdf / weights;
  return s;
}

// Share of light that goes straight through.
HW_FN vec3 closures_transparency(HW_IN(ClosureList) list) {
  vec3 sum = vec3(0.0f);
  if (HW_HAS(HW_FEATURE_TRANSPARENT)) {
    for (uint i = 0u; i < list.count; ++i) {
      Closure c = closure_load(list, i);
      if (closure_type(c) == HW_CLOSURE_TRANSPARENT) sum += c.weight;
    }
  }
  return sum;
}

HW_NAMESPACE_END
#endif
