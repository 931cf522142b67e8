// SPDX-License-Identifier: Apache-2.0
// The closure record: what a material program leaves at a hit, and what the stages read back. 64 bytes, scalar layout.
#ifndef HW_CLOSURE_H
#define HW_CLOSURE_H
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_MAX_CLOSURES = 8u;  // records a path owns; the last is kept for transparency

// `type`, bits 0..7. The order is used: diffuse family <= TRANSLUCENT < glossy family <= GLOSSY_TOON.
HW_CONST uint HW_CLOSURE_NONE = 0u;
HW_CONST uint HW_CLOSURE_DIFFUSE = 1u;
HW_CONST uint HW_CLOSURE_OREN_NAYAR = 2u;
HW_CONST uint HW_CLOSURE_SHEEN = 3u;
HW_CONST uint HW_CLOSURE_DIFFUSE_TOON = 4u;
HW_CONST uint HW_CLOSURE_TRANSLUCENT = 5u;
HW_CONST uint HW_CLOSURE_GLOSSY = 6u;  // GGX reflection
HW_CONST uint HW_CLOSURE_GLOSSY_TOON = 7u;
HW_CONST uint HW_CLOSURE_REFRACTION = 8u;  // GGX refraction only
HW_CONST uint HW_CLOSURE_GLASS = 9u;       // GGX reflection and refraction
HW_CONST uint HW_CLOSURE_TRANSPARENT = 10u;

// `type`, bits 8..10: what reflectance the microfacets have.
HW_CONST uint HW_FRESNEL_NONE = 0u;        // reflects or refracts all (total internal reflection aside)
HW_CONST uint HW_FRESNEL_DIELECTRIC = 1u;  // exact, from `ior`
HW_CONST uint HW_FRESNEL_SCHLICK = 2u;     // exact curve of `ior` remapped so that it starts at f0; tints on both lobes
HW_CONST uint HW_FRESNEL_F82 = 3u;         // metal: f0 and the edge term b
HW_CONST uint HW_FRESNEL_CONDUCTOR = 4u;   // metal: n and k

// `type`, bits 16 and up.
HW_CONST uint HW_CLOSURE_BUMPED = 0x10000u;           // normal differs from the interpolated one
HW_CONST uint HW_CLOSURE_BUMP_CORRECTION = 0x20000u;  // the material asks for the softened bump terminator
HW_CONST uint HW_CLOSURE_REFLECT_TINT = 0x40000u;     // SCHLICK: reflection is tinted by color1
HW_CONST uint HW_CLOSURE_NO_REFLECT = 0x80000u;       // SCHLICK: no reflection (caustics off)
HW_CONST uint HW_CLOSURE_NO_TRANSMIT = 0x100000u;     // SCHLICK: no transmission (caustics off)

struct Closure {
  uint type;  // HW_CLOSURE_* | HW_FRESNEL_* << 8 | flags
  vec3 weight;
  float sample_weight;     // >= 0; the chance of being picked is this over the list's sum
  vec3 N;                  // shading normal, unit, world space, towards the viewer's side
  float alpha_x;           // microfacets: alpha along `tangent`; Oren-Nayar: roughness; sheen: LTC a; toon: size [rad];
                           //   diffuse: share that layers above leave of `weight`, seen from here; 0: not a mere factor
  float alpha_y;           // microfacets: alpha across; sheen: LTC b; toon: smooth [rad]
  float ior;               // microfacets: index below the surface over index above (viewer's side)
  float energy_scale;      // microfacets: restores the energy of multiple scattering
  uint color0_rg;          // six half floats, two colours. SCHLICK: f0 and tint; F82: f0 and b; CONDUCTOR: n and k;
  uint color0_b_color1_r;  //   Oren-Nayar: the multiple-scattering term of the viewing direction
  uint color1_gb;
  uint tangent;  // octahedral, 2 x 16 bit
};
HW_CONST uint HW_CLOSURE_BYTES = 64u;
HW_CHECK_SIZE(Closure, HW_CLOSURE_BYTES)

// What a sampled direction is. REFLECT or TRANSMIT, and one of DIFFUSE, GLOSSY, SINGULAR; straight through: TRANSMIT |
// TRANSPARENT.
HW_CONST uint HW_LABEL_NONE = 0u;
HW_CONST uint HW_LABEL_REFLECT = 1u;
HW_CONST uint HW_LABEL_TRANSMIT = 2u;
HW_CONST uint HW_LABEL_DIFFUSE = 4u;
HW_CONST uint HW_LABEL_GLOSSY = 8u;
HW_CONST uint HW_LABEL_SINGULAR = 16u;
HW_CONST uint HW_LABEL_TRANSPARENT = 32u;

// The hit as closures see it. Ng and Ns are flipped so that Ng faces the viewer (dot(Ng, wo) >= 0).
struct ShadingGeometry {
  vec3 wo;     // unit, towards the viewer
  vec3 Ng;     // geometric normal
  vec3 Ns;     // interpolated normal, before any bump or normal map
  uint flags;  // HW_SHADE_*
};
HW_CONST uint HW_SHADE_BACKFACING = 1u;              // the ray came from inside: indices of refraction are inverted
HW_CONST uint HW_SHADE_BUMP_CORRECTION = 2u;         // Blender's material setting, on by default
HW_CONST uint HW_SHADE_NO_REFLECTIVE_CAUSTICS = 4u;  // caustics off and the ray is a diffuse bounce
HW_CONST uint HW_SHADE_NO_REFRACTIVE_CAUSTICS = 8u;

// f(wo, wi)·|cos| times weight, split by lobe kind; `pdf` by the sample weights, per solid angle.
struct BsdfValue {
  vec3 diffuse;
  vec3 glossy;
  vec3 transmission;
  float pdf;
  vec3 even;          // part of `diffuse` that is the same from wherever the surface is seen (path reuse)
  float diffuse_pdf;  // part of `pdf` by closures whose label is DIFFUSE | REFLECT (path reuse; closures_eval alone),
  float glossy_pdf;   // and by those whose label is GLOSSY | REFLECT
};

// `value`/`value.pdf` is the path's factor. Where `label` has SINGULAR or TRANSPARENT, the value is the factor of the
// delta and pdf the probability of the choice.
struct BsdfSample {
  vec3 wi;
  BsdfValue value;
  uint label;       // HW_LABEL_*; HW_LABEL_NONE: the path ends
  float roughness;  // sqrt(alpha_x alpha_y) of the closure: 0 for deltas, 1 for diffuse
  float eta;        // index of refraction crossed (below over above), 1 for reflection
};

// Principled BSDF, in the order of Blender 5.0's sockets. Subsurface radius, scale, IOR and anisotropy are left out:
// subsurface scattering is shaded as diffuse.
struct PrincipledInputs {
  vec3 base_color;
  float metallic;
  float roughness;
  float ior;
  float alpha;
  vec3 normal;  // unit; Ns where nothing is linked
  float diffuse_roughness;
  float subsurface_weight;
  float specular_ior_level;  // 0.5: as the IOR says
  vec3 specular_tint;
  float anisotropic;
  float anisotropic_rotation;  // 0..1, a full turn
  vec3 tangent;
  float transmission_weight;
  float coat_weight;
  float coat_roughness;
  float coat_ior;
  vec3 coat_tint;
  vec3 coat_normal;  // unit; Ns (not `normal`) where nothing is linked
  float sheen_weight;
  float sheen_roughness;
  vec3 sheen_tint;
  vec3 emission_color;
  float emission_strength;
  float thin_film_thickness;  // [nm]; not shaded yet
  float thin_film_ior;
  uint multiscatter;  // 1: Multiscatter GGX, Blender's default; 0: GGX
};

HW_NAMESPACE_END
#endif
