// SPDX-License-Identifier: Apache-2.0
// Blender's Principled BSDF as Cycles 5.0 builds it: transparency; then from the top sheen, coat, (emission,) metal,
// transmission, dielectric specular over diffuse. A layer's albedo is taken from what lies below it.
//
// Departures: subsurface scattering is diffuse; thin film is left out.
#ifndef HW_PRINCIPLED_H
#define HW_PRINCIPLED_H
#include "closure_builders.h"
HW_NAMESPACE_BEGIN

// Coat: a dielectric layer, always with its energy restored, and absorption on the way through it. Returns what is
// left.
HW_FN vec3 principled_coat(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, HW_IN(PrincipledInputs) p,
                           vec3 weight) {
  float coat = max(p.coat_weight, 0.0f);
  if (coat <= HW_CLOSURE_WEIGHT_CUTOFF) return weight;
  vec3 N = closure_valid_normal(g, p.coat_normal);
  float ior = max(p.coat_ior, 1.0f);
  Closure c = closure_make(HW_CLOSURE_GLOSSY | (HW_FRESNEL_DIELECTRIC << 8u), g, weight * coat, N);
  c.ior = ior;
  float alpha = square(saturate(p.coat_roughness));
  closure_set_roughness(c, alpha, alpha);
  bool reflects = (g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) == 0u && c.sample_weight > 0.0f;
  vec3 albedo = closure_finish_microfacet(c, HW_FRESNEL_DIELECTRIC, g.wo, vec3(fresnel_dielectric_mean(ior)), 1u);
  c.sample_weight = reflects ? c.sample_weight : 0.0f;
  closures_push(list, c);
  vec3 left = reflects ? closure_layer(albedo, weight) : weight;
  // Beer's law: the tint is what a path of length 1 (straight down) lets through; refracted, the path is 1 / cos long.
  float cos_o = dot(g.wo, N);
  float cos_t = sqrt(max(1.0f - (1.0f - cos_o * cos_o) / (ior * ior), 1e-12f));
  vec3 tint = pow(max(p.coat_tint, vec3(0.0f)), vec3(1.0f / cos_t));
  return left * mix(vec3(1.0f), tint, coat);
}

// Returns the emission that leaves the surface (under coat and sheen), times weight and alpha [radiance].
HW_FN vec3 closures_add_principled(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight,
                                   HW_IN(PrincipledInputs) p) {
  bool reflects = (g.flags & HW_SHADE_NO_REFLECTIVE_CAUSTICS) == 0u;
  vec3 base = max(p.base_color, vec3(0.0f));
  vec3 base1 = min(base, vec3(1.0f));
  vec3 specular_tint = max(p.specular_tint, vec3(0.0f));
  float ior = max(p.ior, 1e-5f);
  vec3 N = closure_valid_normal(g, p.normal);

  float alpha = saturate(p.alpha);
  closures_add_transparent(list, weight, vec3(1.0f - alpha));
  vec3 w = vec3(weight * alpha);
  float layers = 1.0f;  // what those above leave of w, as far as it depends on where it is seen from; 0: no one factor

  if (HW_HAS(HW_FEATURE_SHEEN)) {
    float sheen = max(p.sheen_weight, 0.0f);
    if (sheen > HW_CLOSURE_WEIGHT_CUTOFF) {
      vec3 sheen_N = mix(p.normal, p.coat_normal, saturate(p.coat_weight));
      float length2 = dot(sheen_N, sheen_N);
      sheen_N = p.coat_weight > 0.0f && length2 > 0.0f ? sheen_N * inversesqrt(length2) : p.normal;
      vec3 albedo =
          closures_push_sheen(list, g, w * max(p.sheen_tint, vec3(0.0f)) * sheen, saturate(p.sheen_roughness), sheen_N);
      layers *= closure_layer_factor(albedo, w);
      w = closure_layer(albedo, w);
    }
  }
  if (HW_HAS(HW_FEATURE_COAT)) {
    w = principled_coat(list, g, p, w);
    layers = p.coat_weight > HW_CLOSURE_WEIGHT_CUTOFF ? 0.0f : layers;
  }

  vec3 emission = p.emission_color * p.emission_strength * w;

  if (HW_HAS(HW_FEATURE_METALLIC)) {
    float metallic = saturate(p.metallic);
    if (metallic > HW_CLOSURE_WEIGHT_CUTOFF) {
      Closure c = closure_make(HW_CLOSURE_GLOSSY | (HW_FRESNEL_F82 << 8u), g, w * (reflects ? metallic : 0.0f), N);
      closure_set_anisotropy(c, p.roughness, p.anisotropic, p.anisotropic_rotation, p.normal, p.tangent);
      closures_push_f82(list, c, g, base1, min(specular_tint, vec3(1.0f)), p.multiscatter);
      w = w * (1.0f - metallic);
    }
  }
  if (HW_HAS(HW_FEATURE_TRANSMISSION)) {
    float transmission = saturate(p.transmission_weight);
    if (transmission > HW_CLOSURE_WEIGHT_CUTOFF) {
      closures_push_glass(list, g, w * transmission, p.roughness, ior, specular_tint * f0_from_ior(ior), sqrt(base1),
                          0u, N, p.multiscatter);
      w = w * (1.0f - transmission);
    }
  }
  if (HW_HAS(HW_FEATURE_GLOSSY)) {
    // Specular IOR Level scales the reflectance at normal incidence; the curve follows the index that has it.
    float f0 = f0_from_ior(ior);
    float level = max(p.specular_ior_level, 0.0f);
    float scaled = ior_from_f0(f0 * 2.0f * level);
    float eta = level == 0.5f ? ior : (ior < 1.0f ? 1.0f / scaled : scaled);
    f0 = level == 0.5f ? f0 : f0 * 2.0f * level;
    vec3 f0_color = saturate3(specular_tint * f0);
    Closure c =
        closure_make(HW_CLOSURE_GLOSSY | (HW_FRESNEL_SCHLICK << 8u), g, reflects && eta != 1.0f ? w : vec3(0.0f), N);
    c.ior = eta;
    closure_set_anisotropy(c, p.roughness, p.anisotropic, p.anisotropic_rotation, p.normal, p.tangent);
    closure_set_colors(c, f0_color, vec3(0.0f));
    vec3 mean_fresnel = mix(f0_color, vec3(1.0f), fresnel_rise(fresnel_dielectric_mean(eta), eta));
    bool there = c.sample_weight > 0.0f;
    vec3 albedo = closure_finish_microfacet(c, HW_FRESNEL_SCHLICK, g.wo, mean_fresnel, p.multiscatter);
    closures_push(list, c);
    layers *= there ? closure_layer_factor(albedo, w) : 1.0f;
    w = there ? closure_layer(albedo, w) : w;
  }

  // Subsurface scattering clamps its colour, diffuse reflection does not.
  float subsurface = saturate(p.subsurface_weight);
  vec3 diffuse = mix(base, base1, subsurface);
  Closure c = closure_make(HW_CLOSURE_DIFFUSE, g, diffuse * w, p.normal);
  c.alpha_x = layers;
  if (HW_HAS(HW_FEATURE_ROUGH_DIFFUSE)) {
    float roughness = saturate(p.diffuse_roughness);
    if (roughness >= HW_CLOSURE_WEIGHT_CUTOFF) {
      c.type += HW_CLOSURE_OREN_NAYAR - HW_CLOSURE_DIFFUSE;
      c.alpha_x = roughness;
      closure_set_colors(c, oren_nayar_multiscatter(roughness, base, dot(p.normal, g.wo)), vec3(0.0f));
    }
  }
  closures_push(list, c);
  return emission;
}

HW_NAMESPACE_END
#endif
