// SPDX-License-Identifier: Apache-2.0
// A ray of pipeline_closest.rgen that hit nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_pipeline.glsl"

layout(location = 0) rayPayloadInEXT Hit hit;

void main() { hit = no_hit(gl_RayTmaxEXT); }
