// SPDX-License-Identifier: Apache-2.0
// What the shaders of the ray tracing pipelines share (GLSL_EXT_ray_tracing). They trace what ray query traces
// (lib/ray_query.glsl): triangles are opaque, lamps are boxes with an intersection shader.
#extension GL_EXT_ray_tracing : require

#include "lib/trace_io.glsl"

// From the shader binding table (core/gpu/ray_pipeline.cpp): one miss shader; hit group 0 for triangles, and 1 for lamps by
// their instance's offset in the top structure.
#define HW_TRACE(FLAGS, RAY)                                                                                     \
  traceRayEXT(accelerationStructureEXT(push.structure), gl_RayFlagsOpaqueEXT | (FLAGS), (RAY).mask, 0, 0, 0,     \
              (RAY).origin, (RAY).tmin, (RAY).direction, (RAY).tmax, 0)
