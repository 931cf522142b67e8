// SPDX-License-Identifier: Apache-2.0
// Builders of closures: one function a Blender shader node, appending to a list what Cycles 5.0 makes of it. Principled
// is in principled.h, which this file includes at its end.
//
// `weight` is the mix weight of the node in its tree (product of Mix Shader factors); colours are linear and may exceed
// 1 where Blender lets them. `N` is the node's normal input (g.Ns where nothing is linked), unit. `tangent` need not be
// unit nor orthogonal to N; it matters only where anisotropy is not 0. Roughness is Blender's (alpha is its square).
#ifndef HW_CLOSURE_BUILDERS_H
#define HW_CLOSURE_BUILDERS_H
#include "closure_list.h"
#include "microfacet_closure.h"
#include "oren_nayar.h"
HW_NAMESPACE_BEGIN

// Where the mirror image of the viewer about N would go below the surface (or graze it), N turned towards Ng just so
// far that it does not. With N' at angle t from Ng in the plane of both and wo = (a sin p, ., a cos p) there, the
// reflected direction's height is a cos(2t - p): the limit `height` is reached at 2t = p + acos(height / a).
HW_FN vec3 closure_valid_normal(HW_IN(ShadingGeometry) g, vec3 N) {
  if (!HW_HAS(HW_FEATURE_BUMP)) return N;
  vec3 r = 2.0f * dot(N, g.wo) * N - g.wo;
  float wo_z = dot(g.wo, g.Ng);
  float height = min(0.9f * wo_z, 0.01f);
  vec3 side = N - dot(N, g.Ng) * g.Ng;
  float side2 = dot(side, side);
  bool valid = (g.flags & HW_SHADE_BUMP_CORRECTION) == 0u || dot(g.Ng, r) >= height || side2 < 1e-14f;
  side = side * inversesqrt(max(side2, 1e-14f));
  float wo_x = dot(g.wo, side);
  float a2 = max(wo_x * wo_x + wo_z * wo_z, 1e-14f);
  float cos_2t = clamp((wo_z * height - wo_x * safe_sqrt(a2 - height * height)) / a2, -1.0f, 1.0f);
  vec3 turned = side * safe_sqrt(0.5f - 0.5f * cos_2t) + g.Ng * safe_sqrt(0.5f + 0.5f * cos_2t);
  return valid ? N : turned;
}

// A record with nothing but type, weight and normal. A mean weight under the cutoff (or not finite) gives sample_weight
// 0.
HW_FN Closure closure_make(uint type, HW_IN(ShadingGeometry) g, vec3 weight, vec3 N) {
  Closure c;
  c.weight = max(weight, vec3(0.0f));
  float mean = mean3(c.weight);
  c.sample_weight = mean >= HW_CLOSURE_WEIGHT_CUTOFF && mean < HW_INFINITY ? mean : 0.0f;
  uint bump =
      (g.flags & HW_SHADE_BUMP_CORRECTION) != 0u ? HW_CLOSURE_BUMPED | HW_CLOSURE_BUMP_CORRECTION : HW_CLOSURE_BUMPED;
  bool turned = N.x != g.Ns.x || N.y != g.Ns.y || N.z != g.Ns.z;
  c.type = type | (turned ? bump : 0u);
  c.N = N;
  c.alpha_x = 1.0f;
  c.alpha_y = 1.0f;
  c.ior = 1.0f;
  c.energy_scale = 1.0f;
  c.tangent = 0u;
  c.color0_rg = 0u;
  c.color0_b_color1_r = 0u;
  c.color1_gb = 0u;
  return c;
}

// What a layer with this albedo leaves to the layers below it: the channel that loses most decides, so that colours
// under a tinted layer do not shift.
HW_FN float closure_layer_factor(vec3 layer_albedo, vec3 weight) {
  vec3 ratio =
      vec3(weight.x != 0.0f ? layer_albedo.x / weight.x : 0.0f, weight.y != 0.0f ? layer_albedo.y / weight.y : 0.0f,
           weight.z != 0.0f ? layer_albedo.z / weight.z : 0.0f);
  return saturate(1.0f - max3(ratio));
}
HW_FN vec3 closure_layer(vec3 layer_albedo, vec3 weight) { return weight * closure_layer_factor(layer_albedo, weight); }

// The microfacet's colours are set. Sampling by its albedo; then, for Multiscatter GGX, energy lost between facets is
// given back: Turquin 2019, "Practical multiple scattering compensation for microfacet models" (scaling by 1/E) with
// the darkening of several reflections of Kulla and Conty 2017, for facets whose mean reflectance is `mean_fresnel`.
// Returns the albedo of the reflection with the weight in it. `kind`: the closure's HW_FRESNEL_*.
HW_FN vec3 closure_finish_microfacet(HW_INOUT(Closure) c, uint kind, vec3 wo, vec3 mean_fresnel, uint multiscatter) {
  vec3 R, T;
  microfacet_albedo(c, kind, wo, R, T);
  c.sample_weight *= mean3(R + T);
  if (HW_HAS(HW_FEATURE_MULTISCATTER)) {
    float r = microfacet_roughness(c);
    float cos_o = dot(c.N, wo);
    float E = lut_2d(HW_LUT_E, 32u, r, cos_o);
    float E_mean = lut_1d(HW_LUT_E_MEAN, 32u, r);
    if (HW_HAS(HW_FEATURE_TRANSMISSION)) {
      if (closure_type(c) == HW_CLOSURE_GLASS) {
        float z = sqrt(abs((c.ior - 1.0f) / (c.ior + 1.0f)));
        E = lut_3d(c.ior < 1.0f ? HW_LUT_GLASS_INV : HW_LUT_GLASS, 16u, r, cos_o, z);
        E_mean = lut_2d(c.ior < 1.0f ? HW_LUT_GLASS_INV_MEAN : HW_LUT_GLASS_MEAN, 16u, r, z);
      }
    }
    float missing = 1.0f - E;  // times the scale 1/E
    vec3 several = mean_fresnel * E_mean / (vec3(1.0f) - mean_fresnel * (1.0f - E_mean));
    vec3 darkening = vec3(E) + several * missing;
    bool on = multiscatter != 0u;
    c.energy_scale = on ? 1.0f / E : 1.0f;
    c.weight = on ? c.weight * darkening : c.weight;
    c.sample_weight = on ? c.sample_weight * mean3(darkening) : c.sample_weight;
  }
  return c.weight * R;
}

HW_FN void closure_set_roughness(HW_INOUT(Closure) c, float alpha_x, float alpha_y) {
  c.alpha_x = saturate(alpha_x);
  c.alpha_y = saturate(alpha_y);
}

// Principled's and Metallic's anisotropy, 0..1: alpha stretched along the turned tangent.
HW_FN void closure_set_anisotropy(HW_INOUT(Closure) c, float roughness, float anisotropy, float rotation, vec3 N,
                                  vec3 tangent) {
  float alpha = square(saturate(roughness));
  closure_set_roughness(c, alpha, alpha);
  if (HW_HAS(HW_FEATURE_ANISOTROPY)) {
    float aspect = sqrt(1.0f - saturate(anisotropy) * 0.9f);
    closure_set_roughness(c, alpha / aspect, alpha * aspect);
    vec3 t = rotate_about(tangent, N, rotation * (2.0f * HW_PI));
    c.tangent = octahedral_pack(dot(t, t) > 0.0f ? t : vec3(0.0f, 0.0f, 1.0f));
  }
}

// Nodes --------------------------------------------------------------------------------------------------------------

HW_FN void closures_add_transparent(HW_INOUT(ClosureList) list, float weight, vec3 color) {
  vec3 w = color * weight;
  // The comparison also keeps out what is not finite.
  if (abs(mean3(w)) >= HW_CLOSURE_WEIGHT_CUTOFF && abs(mean3(w)) < HW_INFINITY) list.transparent += w;
}

HW_FN void closures_add_diffuse(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                                float roughness, vec3 N) {
  Closure c = closure_make(HW_CLOSURE_DIFFUSE, g, color * weight, N);
  if (HW_HAS(HW_FEATURE_ROUGH_DIFFUSE)) {
    if (roughness >= 1e-5f) {
      c.type += HW_CLOSURE_OREN_NAYAR - HW_CLOSURE_DIFFUSE;
      c.alpha_x = saturate(roughness);
      closure_set_colors(c, oren_nayar_multiscatter(c.alpha_x, color, dot(N, g.wo)), vec3(0.0f));
    }
  }
  closures_push(list, c);
}

HW_FN void closures_add_translucent(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                                    vec3 N) {
  closures_push(list, closure_make(HW_CLOSURE_TRANSLUCENT, g, color * weight, closure_valid_normal(g, N)));
}

// The sheen's albedo is in the weight: returned for the layers below. 0 where the table has no sheen to give.
HW_FN vec3 closures_push_sheen(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, vec3 weight, float roughness,
                               vec3 N) {
  Closure c = closure_make(HW_CLOSURE_SHEEN, g, weight, N);
  float r = clamp(roughness, 1e-3f, 1.0f);
  float cos_o = dot(N, g.wo);
  c.alpha_x = lut_sheen(0u, cos_o, r);
  c.alpha_y = lut_sheen(1u, cos_o, r);
  float albedo = lut_sheen(2u, cos_o, r);
  albedo = abs(c.alpha_x) < 1e-5f || albedo < 1e-5f ? 0.0f : albedo;
  c.weight = c.weight * (c.sample_weight > 0.0f ? albedo : 0.0f);
  c.sample_weight *= albedo;
  closures_push(list, c);
  return c.weight;
}

HW_FN void closures_add_sheen(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                              float roughness, vec3 N) {
  closures_push_sheen(list, g, color * weight, roughness, N);
}

// glossy: 0 diffuse, 1 glossy component. size and border (the node's Smooth) in 0..1.
HW_FN void closures_add_toon(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, float size,
                             float border, uint glossy, vec3 N) {
  if (glossy != 0u && (g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) != 0u) return;
  Closure c = closure_make(glossy != 0u ? HW_CLOSURE_GLOSSY_TOON : HW_CLOSURE_DIFFUSE_TOON, g, color * weight, N);
  c.alpha_x = clamp(size, 1e-5f, 1.0f) * (0.5f * HW_PI);
  c.alpha_y = saturate(border) * (0.5f * HW_PI);
  closures_push(list, c);
}

// multiscatter: 1 for the Multiscatter GGX distribution, 0 for GGX. Anisotropy -1..1; rotation: 0..1 is a full turn.
HW_FN void closures_add_glossy(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                               float roughness, float anisotropy, float rotation, vec3 N, vec3 tangent,
                               uint multiscatter) {
  if ((g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) != 0u) return;
  Closure c = closure_make(HW_CLOSURE_GLOSSY | (HW_FRESNEL_NONE << 8u), g, color * weight, closure_valid_normal(g, N));
  float alpha = square(saturate(roughness));
  closure_set_roughness(c, alpha, alpha);
  if (HW_HAS(HW_FEATURE_ANISOTROPY)) {
    float a = clamp(anisotropy, -0.99f, 0.99f);
    if (abs(a) > 1e-4f) {
      closure_set_roughness(c, a < 0.0f ? alpha / (1.0f + a) : alpha * (1.0f - a),
                            a < 0.0f ? alpha * (1.0f + a) : alpha / (1.0f - a));
      vec3 t = rotate_about(tangent, c.N, rotation * (2.0f * HW_PI));
      c.tangent = octahedral_pack(dot(t, t) > 0.0f ? t : vec3(0.0f, 0.0f, 1.0f));
    }
  }
  closure_finish_microfacet(c, HW_FRESNEL_NONE, g.wo, max(color, vec3(0.0f)), multiscatter);
  closures_push(list, c);
}

HW_FN void closures_add_refraction(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                                   float roughness, float ior, vec3 N) {
  if (!HW_HAS(HW_FEATURE_TRANSMISSION)) return;
  if ((g.flags & HW_SHADE_NO_REFRACTIVE_CAUSTICS) != 0u) return;
  Closure c =
      closure_make(HW_CLOSURE_REFRACTION | (HW_FRESNEL_NONE << 8u), g, color * weight, closure_valid_normal(g, N));
  float alpha = square(roughness);
  closure_set_roughness(c, alpha, alpha);
  float eta = max(ior, 1e-5f);
  c.ior = (g.flags & HW_SHADE_BACKFACING) != 0u ? 1.0f / eta : eta;
  closures_push(list, c);
}

// Glass of the given index and tints: Glass node and Principled's transmission. f0 is its reflectance at normal
// incidence.
HW_FN void closures_push_glass(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, vec3 weight, float roughness,
                               float ior, vec3 f0, vec3 tint, uint tint_flag, vec3 N, uint multiscatter) {
  if (!HW_HAS(HW_FEATURE_TRANSMISSION)) return;
  bool reflects = (g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) == 0u;
  bool transmits = (g.flags & HW_SHADE_NO_REFRACTIVE_CAUSTICS) == 0u;
  if (!reflects && !transmits) return;
  Closure c = closure_make(HW_CLOSURE_GLASS | (HW_FRESNEL_SCHLICK << 8u), g, weight, N);
  c.type |= tint_flag | (reflects ? 0u : HW_CLOSURE_NO_REFLECT) | (transmits ? 0u : HW_CLOSURE_NO_TRANSMIT);
  c.ior = (g.flags & HW_SHADE_BACKFACING) != 0u ? 1.0f / ior : ior;
  float alpha = square(saturate(roughness));
  closure_set_roughness(c, alpha, alpha);
  vec3 clamped_f0 = saturate3(f0);
  closure_set_colors(c, clamped_f0, tint);
  // The tint of what goes through stands for the colour of the whole; with refraction off, the reflectance's mean does.
  float rise = fresnel_rise(fresnel_dielectric_mean(c.ior), c.ior);
  vec3 reflect_mean = microfacet_reflect_tint(c) * mix(clamped_f0, vec3(1.0f), rise);
  bool through = transmits && max3(tint) > 0.0f;
  closure_finish_microfacet(c, HW_FRESNEL_SCHLICK, g.wo, through ? tint : reflect_mean, multiscatter);
  closures_push(list, c);
}

HW_FN void closures_add_glass(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                              float roughness, float ior, vec3 N, uint multiscatter) {
  float eta = max(ior, 1e-5f);
  closures_push_glass(list, g, vec3(weight), roughness, eta, vec3(f0_from_ior(eta)), max(color, vec3(0.0f)),
                      HW_CLOSURE_REFLECT_TINT, closure_valid_normal(g, N), multiscatter);
}

HW_FN void closures_push_f82(HW_INOUT(ClosureList) list, HW_IN(Closure) facets, HW_IN(ShadingGeometry) g, vec3 f0,
                             vec3 tint, uint multiscatter) {
  Closure c = facets;
  vec3 edge = f82_edge_from_tint(f0, tint);
  closure_set_colors(c, f0, edge);
  closure_finish_microfacet(c, HW_FRESNEL_F82, g.wo, fresnel_f82_mean(f0, edge), multiscatter);
  closures_push(list, c);
}

// Metallic node, "F82 Tint".
HW_FN void closures_add_metallic_f82(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight,
                                     vec3 base_color, vec3 edge_tint, float roughness, float anisotropy, float rotation,
                                     vec3 N, vec3 tangent, uint multiscatter) {
  if (!HW_HAS(HW_FEATURE_METALLIC)) return;
  if ((g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) != 0u) return;
  Closure c = closure_make(HW_CLOSURE_GLOSSY | (HW_FRESNEL_F82 << 8u), g, vec3(weight), closure_valid_normal(g, N));
  closure_set_anisotropy(c, roughness, anisotropy, rotation, N, tangent);
  closures_push_f82(list, c, g, saturate3(base_color), saturate3(edge_tint), multiscatter);
}

// Metallic node, "Physical Conductor": complex index of refraction n + ik per channel.
HW_FN void closures_add_metallic_conductor(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 n,
                                           vec3 k, float roughness, float anisotropy, float rotation, vec3 N,
                                           vec3 tangent, uint multiscatter) {
  if (!HW_HAS(HW_FEATURE_CONDUCTOR)) return;
  if ((g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) != 0u) return;
  Closure c =
      closure_make(HW_CLOSURE_GLOSSY | (HW_FRESNEL_CONDUCTOR << 8u), g, vec3(weight), closure_valid_normal(g, N));
  closure_set_anisotropy(c, roughness, anisotropy, rotation, N, tangent);
  closure_set_colors(c, max(n, vec3(0.0f)), max(k, vec3(0.0f)));
  closure_finish_microfacet(c, HW_FRESNEL_CONDUCTOR, g.wo, fresnel_conductor_mean(closure_color0(c), closure_color1(c)),
                            multiscatter);
  closures_push(list, c);
}

HW_NAMESPACE_END

#include "principled.h"

#endif
