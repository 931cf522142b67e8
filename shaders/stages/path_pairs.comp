// SPDX-License-Identifier: Apache-2.0
// Path reuse: every shared vertex of a wave seen from every anchor of its group, with a ray between them. One thread a
// pair; the pair of vertex `path` and member `m` lies at path * HW_REUSE_PIXELS + m (lib/path_reuse.glsl).
// a: pairs; b: paths of each anchor; c: first pair of this dispatch; out_queue: pairs to trace.
#version 460
#extension GL_GOOGLE_include_directive : require
#define HW_CLOSURES_KEPT
#include "lib/closures.h"
#include "lib/frame.h"
#include "lib/path_reuse.glsl"
#include "lib/wave.glsl"
layout(local_size_x = 64) in;

// What anchor `first` makes of the vertex, and how likely it would have found it: pair `index`. `normal`: the vertex'.
SharedPair seen_from(uint index, uint first, SurfacePoint point, vec3 position, vec3 normal, bool glossy) {
  SharedPair pair;
  pair.f = vec3(0.0);
  pair.pdf = 0.0;
  vec3 to = position - point.position;
  float distance2 = dot(to, to);
  vec3 wi = to * inversesqrt(max(distance2, 1e-30));
  float cos_vertex = -dot(normal, wi);
  // Diffuse closures are sampled on their side of the geometric normal (lib/closures.h).
  if (!(cos_vertex > 0.0 && dot(point.normal, wi) > 0.0 && distance2 > 0.0)) return pair;
  ShadingGeometry sg;
  sg.wo = -ray_load(first).direction;
  sg.Ng = point.normal;
  sg.Ns = point.shading_normal;
  sg.flags = point.flags & HW_SURFACE_SHADE_FLAGS;
  ClosureList list = closures_at(HW_FRAME.closures + uint64_t(first) * uint64_t(HW_MAX_CLOSURES * HW_CLOSURE_BYTES), point.closure_count);
  BsdfValue bsdf = closures_eval(list, sg, wi);
  float chance = glossy ? bsdf.glossy_pdf : bsdf.diffuse_pdf;
  if (!(chance > 0.0)) return pair;
  float geometry = cos_vertex / distance2;
  // Of all that is reflected, as much as a path would bring whose sample is labelled so.
  float part = chance / bsdf.pdf * geometry;
  pair.f = bsdf_value_total(bsdf) * part;
  pair.pdf = chance * geometry;
  if (HW_LIGHT_PASSES) SharedShareArray(HW_FRAME.shared_shares).at[index] = bsdf.diffuse * part;
  return pair;
}

void main() {
  uint thread = push.c + gl_GlobalInvocationID.x;
  if (thread >= push.a) return;
  uint member = thread % HW_REUSE_PIXELS, way = thread / HW_REUSE_PIXELS % push.b;
  uint number = thread / (HW_REUSE_PIXELS * push.b);
  uint anchor = number * HW_FRAME.places;
  if ((path_flags(anchor) & HW_PATH_ANCHOR) == 0u) return;
  uint path = anchor + 1u + way;
  SharedVertex vertex = SharedVertexArray(HW_FRAME.shared_vertices).at[path];
  if (vertex.kind != HW_SHARED_MET || !(dot(abs(vertex.light), vec3(1.0)) > 0.0)) return;

  uint index = path * HW_REUSE_PIXELS + member;
  uint other = reuse_other(number, member);
  uint first = other * HW_FRAME.places;
  SharedPair pair;
  pair.f = vec3(0.0);
  pair.pdf = 0.0;
  if (other != HW_NONE && (path_flags(first) & HW_PATH_ANCHOR) != 0u) {
    SurfacePoint point = surface_load(first);
    vec3 normal = octahedral_unpack(vertex.normal);
    bool glossy = vertex.glossy != 0u;
    if ((point.flags & (glossy ? HW_SURFACE_GIVES_GLOSSY : HW_SURFACE_GIVES)) != 0u)
      pair = seen_from(index, first, point, vertex.position, normal, glossy);
    UintBuffer(HW_FRAME.shared_hits).at[index] = 0u;
    if (pair.pdf > 0.0 && other != number) {
      Ray ray;
      ray.origin = offset_origin(point.position, point.normal);
      vec3 along = offset_origin(vertex.position, normal) - ray.origin;
      float length2 = dot(along, along);
      float inverse = inversesqrt(max(length2, 1e-30));
      ray.direction = along * inverse;
      ray.tmin = 0.0;
      ray.tmax = length2 * inverse;
      ray.mask = glossy ? HW_MASK_GLOSSY : HW_MASK_DIFFUSE;
      ray.flags = 0u;
      RayArray(HW_FRAME.shared_rays).at[index] = ray;
      queue_push(push.out_queue, index);
    }
  }
  SharedPairArray(HW_FRAME.shared_pairs).at[index] = pair;
}
