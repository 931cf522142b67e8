// SPDX-License-Identifier: Apache-2.0
// What a scene uses, one bit each. In GLSL it is specialisation constant 0 of every kernel, so that what is not used is
// not in the kernel; in C++ everything is on.
#ifndef HW_FEATURES_H
#define HW_FEATURES_H
#include "portable.h"
HW_NAMESPACE_BEGIN

// Closures, bits 0..15.
HW_CONST uint HW_FEATURE_GLOSSY = 1u << 0;        // any GGX reflection: Principled's dielectric layer, Glossy, metals
HW_CONST uint HW_FEATURE_METALLIC = 1u << 1;      // F82 metals
HW_CONST uint HW_FEATURE_CONDUCTOR = 1u << 2;     // physical conductor (n, k) of the Metallic node
HW_CONST uint HW_FEATURE_TRANSMISSION = 1u << 3;  // Glass, Refraction, Principled transmission
HW_CONST uint HW_FEATURE_TRANSLUCENT = 1u << 4;
HW_CONST uint HW_FEATURE_SHEEN = 1u << 5;
HW_CONST uint HW_FEATURE_COAT = 1u << 6;
HW_CONST uint HW_FEATURE_ANISOTROPY = 1u << 7;
HW_CONST uint HW_FEATURE_ROUGH_DIFFUSE = 1u << 8;  // Oren-Nayar
HW_CONST uint HW_FEATURE_TOON = 1u << 9;
HW_CONST uint HW_FEATURE_TRANSPARENT = 1u << 10;  // alpha below 1, Transparent
HW_CONST uint HW_FEATURE_BUMP = 1u << 11;  // shading normals: smooth shading, bump, normal maps (all but flat faces)
HW_CONST uint HW_FEATURE_MULTISCATTER = 1u << 12;   // Multiscatter GGX: energy of microfacets restored
HW_CONST uint HW_FEATURE_TEXEL_FORMATS = 1u << 13;  // images of other formats than HW_TEXEL_RGBA8
HW_CONST uint HW_FEATURE_IMAGE_MODES = 1u << 14;    // an image read otherwise than flat, linear and repeated
// Any of the families that leave microfacet records.
HW_CONST uint HW_FEATURE_MICROFACET =
    HW_FEATURE_GLOSSY | HW_FEATURE_METALLIC | HW_FEATURE_CONDUCTOR | HW_FEATURE_TRANSMISSION | HW_FEATURE_COAT;
// Bits 16..27: families of material program operations, HW_VM_* of material_program.h shifted by this much.
HW_CONST uint HW_FEATURE_VM_SHIFT = 16u;
// Bits 28..31: lights and the world.
HW_CONST uint HW_FEATURE_WORLD_PROGRAM = 1u << 28;     // the background is a program, not a constant
HW_CONST uint HW_FEATURE_EMISSION_PROGRAM = 1u << 29;  // some emissive material's emission varies

HW_CONST uint HW_FEATURE_LIGHT_TREE = 1u << 30;   // lights are chosen by the light tree, not the alias table
HW_CONST uint HW_FEATURE_LIGHT_CELLS = 1u << 31;  // by cells that know where light comes from, and the tree below

HW_NAMESPACE_END

#ifdef __cplusplus
#define HW_HAS(bit) true
#define HW_PATH_REUSE true
#else
layout(constant_id = 0) const uint HW_FEATURES = 0xFFFFFFFFu;
#define HW_HAS(bit) ((HW_FEATURES & (bit)) != 0u)
layout(constant_id = 4) const bool HW_PATH_REUSE = false;  // pixels share what their paths found (lib/path_reuse.glsl)
#endif

#endif
