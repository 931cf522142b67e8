// SPDX-License-Identifier: Apache-2.0
// The nearest hit of a ray of pipeline_closest.rgen, with a triangle or a lamp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_pipeline.glsl"

layout(location = 0) rayPayloadInEXT Hit hit;
hitAttributeEXT vec2 uv;

void main() {
  bool triangle = gl_HitKindEXT == gl_HitKindFrontFacingTriangleEXT || gl_HitKindEXT == gl_HitKindBackFacingTriangleEXT;
  hit.t = gl_HitTEXT;
  hit.u = uv.x;
  hit.v = uv.y;
  hit.instance = triangle ? gl_InstanceID : HW_LAMP_INSTANCE;
  hit.primitive = gl_PrimitiveID;
  hit.pad = 0u;
}
