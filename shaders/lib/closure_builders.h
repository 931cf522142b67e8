// SPDX-License-Identifier: Apache-2.0
// Builders of closures: one function a Blender shader node, appending to a list what Cycles 5.0 would make of it.
//
// `weight` is the mix weight of the node in its tree (product of Mix Shader factors); colours are linear and may exceed 1
// where Blender lets them. `N` is the node's normal input (g.Ns where nothing is linked), unit. `tangent` need not be unit
// nor orthogonal to N; it matters only where anisotropy is not 0. Roughness is Blender's (alpha is its square).
#ifndef HW_CLOSURE_BUILDERS_H
#define HW_CLOSURE_BUILDERS_H
#include "closure_list.h"
HW_NAMESPACE_BEGIN

// INTERFACE (bodies to follow in this file and principled.h)

HW_FN void closures_add_transparent(HW_INOUT(ClosureList) list, float weight, vec3 color);
HW_FN void closures_add_diffuse(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, float roughness,
                                vec3 N);
HW_FN void closures_add_translucent(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, vec3 N);
HW_FN void closures_add_sheen(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, float roughness,
                              vec3 N);
// glossy: 0 diffuse, 1 glossy component. size and smooth in 0..1, as the node has them.
HW_FN void closures_add_toon(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, float size,
                             float smooth_, uint glossy, vec3 N);
// multiscatter: 1 for the Multiscatter GGX distribution, 0 for GGX. rotation: 0..1 is a full turn.
HW_FN void closures_add_glossy(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, float roughness,
                               float anisotropy, float rotation, vec3 N, vec3 tangent, uint multiscatter);
HW_FN void closures_add_glass(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color, float roughness,
                              float ior, vec3 N, uint multiscatter);
HW_FN void closures_add_refraction(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 color,
                                   float roughness, float ior, vec3 N);
// Metallic node, "F82 Tint" and "Physical Conductor" (n and k per channel).
HW_FN void closures_add_metallic_f82(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 base_color,
                                     vec3 edge_tint, float roughness, float anisotropy, float rotation, vec3 N, vec3 tangent,
                                     uint multiscatter);
HW_FN void closures_add_metallic_conductor(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, vec3 n, vec3 k,
                                           float roughness, float anisotropy, float rotation, vec3 N, vec3 tangent,
                                           uint multiscatter);
// Returns the emission that leaves the surface (under coat and sheen), times weight and alpha.
HW_FN vec3 closures_add_principled(HW_INOUT(ClosureList) list, HW_IN(ShadingGeometry) g, float weight, HW_IN(PrincipledInputs) p);

HW_NAMESPACE_END
#endif
