// SPDX-License-Identifier: Apache-2.0
// The target function of light reuse, p_hat: an upper estimate of the luminance that a light sends to the viewer by way
// of a surface, without visibility. The light is its proxy (lib/light_proxy.h), the same for every point of it; the
// surface's closures are summed up as one Lambertian and one GGX lobe (with the visibility term of Karis 2013). So it
// costs little and the surfaces of neighbours can be kept in 32 bytes. It is positive wherever light can arrive, which
// is all that resampling asks of it (Talbot 2005); the shading of the chosen sample is exact.
//
// It counts the share of the light that next-event estimation is weighed with against BSDF rays (Veach 1997, power
// heuristic): where BSDF rays find a light well, samples are not spent on it.
#ifndef HW_REUSE_TARGET_H
#define HW_REUSE_TARGET_H
#include "../shared/reuse.h"
#include "closures.h"
#include "frame.h"
#include "light_proxy.h"
HW_NAMESPACE_BEGIN

// Unpacked ReuseSurface.
struct TargetSurface {
  vec3 position;
  uint key;
  vec3 normal;
  vec3 wo;
  float diffuse, glossy;  // albedos, luminance
  float alpha;            // of the glossy lobe
  float transmit;         // albedo towards the other side
};

HW_CONST float HW_TARGET_MIN_ALPHA = 0.02f;  // keeps the lobe's peak within what half floats and MIS can bear
HW_CONST float HW_TARGET_FLOOR = 0.01f;      // of the albedo: what closures scatter where the lobes say none

HW_FN ReuseSurface reuse_surface_none() {
  ReuseSurface s;
  s.position = vec3(0.0f);
  s.key = HW_NONE;
  s.normal = 0u;
  s.wo = 0u;
  s.reflectance = 0u;
  s.alpha_transmit = 0u;
  return s;
}

// Sums up the closures of a shading point. `key`: of its object.
HW_FN ReuseSurface reuse_surface(HW_IN(ClosureList) list, vec3 position, vec3 wo, vec3 Ns, uint key) {
  float diffuse = 0.0f;
  float glossy = 0.0f;
  float transmit = 0.0f;
  float alpha = 0.0f;
  vec3 normal = vec3(0.0f);
  vec3 first = vec3(0.0f);
  bool differ = false;
  for (uint i = 0u; i < list.count; ++i) {
    Closure c = closure_load(list, i);
    float w = closure_is_singular(c) ? 0.0f : c.sample_weight;
    uint t = closure_type(c);
    bool other_side = t == HW_CLOSURE_TRANSLUCENT || t == HW_CLOSURE_REFRACTION || t == HW_CLOSURE_GLASS;
    bool shiny = t >= HW_CLOSURE_GLOSSY && t != HW_CLOSURE_REFRACTION;
    transmit += other_side ? w : 0.0f;
    glossy += shiny ? w : 0.0f;
    alpha += shiny ? w * (closure_is_microfacet(c) ? sqrt(c.alpha_x * c.alpha_y) : 0.5f) : 0.0f;
    diffuse += other_side || shiny ? 0.0f : w;
    normal += c.N * w;
    first = dot(first, first) > 0.0f || !(w > 0.0f) ? first : c.N;
    vec3 off = c.N - first;
    differ = differ || (w > 0.0f && dot(off, off) > 1e-10f);
  }
  float sum = diffuse + glossy + transmit;
  float length_n = length(normal);
  // Normals that differ, however little the closures weigh, leave directions that the mean normal does not see: a part
  // of the floor goes everywhere.
  float spread = differ ? HW_TARGET_FLOOR * sum : 0.0f;
  ReuseSurface s;
  s.position = position;
  s.key = key;
  s.normal = octahedral_pack(length_n > 0.0f ? normal * (1.0f / length_n) : Ns);
  s.wo = octahedral_pack(wo);
  s.reflectance = packHalf2x16(vec2(min(diffuse, 6e4f), min(glossy, 6e4f)));
  s.alpha_transmit = packHalf2x16(vec2(glossy > 0.0f ? alpha / glossy : 1.0f, min(max(transmit, spread), 6e4f)));
  return s;
}

HW_FN TargetSurface target_surface(HW_IN(ReuseSurface) s) {
  TargetSurface t;
  t.position = s.position;
  t.key = s.key;
  t.normal = octahedral_unpack(s.normal);
  t.wo = octahedral_unpack(s.wo);
  vec2 reflectance = unpackHalf2x16(s.reflectance);
  vec2 rest = unpackHalf2x16(s.alpha_transmit);
  t.diffuse = reflectance.x;
  t.glossy = reflectance.y;
  t.alpha = max(rest.x, HW_TARGET_MIN_ALPHA);
  t.transmit = rest.y;
  return t;
}

// p_hat of a light at a surface. `mis_scale`: how many light samples next-event estimation counts as
// (ReuseFrame::light_mis_scale).
HW_FN float target_value(HW_IN(TargetSurface) s, HW_IN(LightProxy) light, float mis_scale) {
  bool sun = (light.flags & HW_PROXY_SUN) != 0u;
  bool world = (light.flags & HW_PROXY_WORLD) != 0u;
  vec3 to_center = sun ? light.center : light.center - s.position;
  float d2 = max(dot(to_center, to_center), 1e-20f);
  float inverse_d = inversesqrt(d2);
  vec3 wi = to_center * inverse_d;
  // Sine of the half angle the light fills: cosines at its points differ by no more from those at its middle.
  float extent = sun ? light.radius : min(light.radius * inverse_d, 1.0f);
  float falloff = sun ? 1.0f : 1.0f / max(d2, 0.25f * light.radius * light.radius);
  vec2 slope = unpackHalf2x16(light.emission);
  float at_light = -dot(octahedral_unpack(light.axis), wi);
  at_light = (light.flags & HW_PROXY_TWO_SIDED) != 0u ? abs(at_light) : at_light;
  float emits = clamp(slope.x * (at_light + extent) + slope.y, 0.0f, 1.0f);

  float cosine = dot(s.normal, wi);
  // 1e-4: what packing may have turned the normal by.
  float above = clamp(cosine + extent + 1e-4f, 0.0f, 1.0f);
  float around = clamp(abs(cosine) + extent + 1e-4f, 0.0f, 1.0f);
  vec3 h = s.wo + wi;
  h = h * inversesqrt(max(dot(h, h), 1e-12f));
  float n_h = clamp(dot(s.normal, h), 0.0f, 1.0f);
  float l_h = clamp(dot(wi, h), 0.05f, 1.0f);
  float alpha = min(s.alpha + 0.5f * extent, 1.0f);
  float a2 = alpha * alpha;
  float q = n_h * n_h * (a2 - 1.0f) + 1.0f;
  float d = a2 * HW_INV_PI / max(q * q, 1e-12f);
  float sum = max(s.diffuse + s.glossy + s.transmit, 1e-20f);
  float lambert = ((s.diffuse + HW_TARGET_FLOOR * sum) * above + s.transmit * around) * HW_INV_PI;
  float f = lambert + s.glossy * d * above / (4.0f * l_h * l_h * (alpha + 0.5f));
  float bsdf_pdf = (lambert + s.glossy * d * n_h / (4.0f * l_h)) / sum;

  float seen = emits * falloff;  // of the light's area, as solid angle
  float r = bsdf_pdf * light.area * seen * light.inverse_choice / mis_scale;
  // Never quite 0 where the exact weight may not be.
  float weight = (light.flags & HW_PROXY_WEIGHED) != 0u ? max(1.0f / (1.0f + r * r), 1e-3f) : 1.0f;
  float v = f * light.intensity * seen * weight;
  v = world ? sum * light.intensity : v;
  v = light.inverse_choice > 0.0f ? v : 0.0f;
  return v < 1e30f ? v : 0.0f;  // NaN and overflow count as nothing
}

HW_NAMESPACE_END
#endif
