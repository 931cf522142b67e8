// SPDX-License-Identifier: Apache-2.0
// A ray of pipeline_any.rgen that nothing blocks.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lib/ray_pipeline.glsl"

layout(location = 0) rayPayloadInEXT uint occluded;

void main() { occluded = 0u; }
