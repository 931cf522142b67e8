// SPDX-License-Identifier: Apache-2.0
// Kinds of light in a scene's table, one bit each. In GLSL they are specialisation constant 3 of every kernel: how a
// light of a kind that the scene has not is sampled is not in the kernel. In C++ everything is on.
#ifndef HW_LIGHT_KINDS_H
#define HW_LIGHT_KINDS_H
#include "lights.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_KIND_TRIANGLE = 1u;
HW_CONST uint HW_KIND_TRIANGLE_MAP = 2u;  // a triangle with an emission map
HW_CONST uint HW_KIND_AREA = 4u;
HW_CONST uint HW_KIND_ELLIPSE = 8u;  // an area lamp that is one
HW_CONST uint HW_KIND_SPREAD = 16u;  // an area lamp whose spread limits it
HW_CONST uint HW_KIND_POINT = 32u;   // point and spot lamps
HW_CONST uint HW_KIND_SPOT = 64u;
HW_CONST uint HW_KIND_BALL = 128u;  // a point or spot lamp that is a sphere: no soft falloff
HW_CONST uint HW_KIND_SUN = 256u;
HW_CONST uint HW_KIND_WORLD = 512u;
// Not in the table: a surface of the scene may shine.
HW_CONST uint HW_KIND_EMISSION = 1024u;

// The bits of one light.
HW_FN uint light_kinds(LightRecord light) {
  if (light.type == HW_LIGHT_TRIANGLE) return HW_KIND_TRIANGLE | (light.emission_map != 0u ? HW_KIND_TRIANGLE_MAP : 0u);
  if (light.type == HW_LIGHT_WORLD) return HW_KIND_WORLD;
  if (light.type == HW_LIGHT_SUN) return HW_KIND_SUN;
  if (light.type == HW_LIGHT_AREA) {
    return HW_KIND_AREA | ((light.flags & HW_LIGHT_ELLIPSE) != 0u ? HW_KIND_ELLIPSE : 0u) |
           (light.spot_smooth > 0.0f ? HW_KIND_SPREAD : 0u);
  }
  return HW_KIND_POINT | (light.type == HW_LIGHT_SPOT ? HW_KIND_SPOT : 0u) |
         ((light.flags & HW_LIGHT_SOFT_FALLOFF) == 0u ? HW_KIND_BALL : 0u);
}

HW_NAMESPACE_END

#ifdef __cplusplus
#define HW_LIT_BY(kind) true
#else
layout(constant_id = 3) const uint HW_LIGHT_KINDS = 0xFFFFFFFFu;
#define HW_LIT_BY(kind) ((HW_LIGHT_KINDS & (kind)) != 0u)
#endif

#endif
