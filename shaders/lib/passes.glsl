// SPDX-License-Identifier: Apache-2.0
// Data passes of the first surface a camera path meets that is not (nearly) transparent, with Cycles' conventions.
#ifndef HW_PASSES_GLSL
#define HW_PASSES_GLSL
#include "camera.h"
#include "closures.h"
#include "geometry.glsl"
#include "wave.glsl"

// Pixels moved since the last frame, as Blender has it: previous minus current place (xy), current minus next (zw, taken
// to be the same: the next frame is not known).
vec4 motion_vector(vec3 P, vec3 previous) {
  CameraRecord camera = HW_ROOT.camera;
  vec2 size = vec2(HW_FRAME.width, HW_FRAME.height);
  vec2 now = camera_project(camera, P) * size;
  vec2 before = camera_project_previous(camera, previous) * size;
  return vec4(before - now, before - now);
}

// The mean normal of what reflects or transmits.
vec3 closures_normal(ClosureList list, ShadingGeometry sg) {
  vec3 normal = vec3(0.0);
  for (uint i = 0u; i < list.count; ++i) {
    Closure c = closure_load(list, i);
    bool through = closure_type(c) == HW_CLOSURE_TRANSPARENT;
    normal += through ? vec3(0.0) : c.N * ((c.weight.x + c.weight.y + c.weight.z) * (1.0 / 3.0));
  }
  return dot(normal, normal) > 0.0 ? normalize(normal) : sg.Ns;
}

// Of the first surface that is opaque enough (the view layer's alpha threshold).
void write_surface_passes(uint path, PathState state, Hit hit, SurfaceGeometry g, ClosureList list, ShadingGeometry sg) {
  bool first_sample = state.sample_index == HW_FRAME.first_sample_of_render;
  CameraRecord camera = HW_ROOT.camera;
  if (first_sample) {
    if (pass_on(HW_PASS_DEPTH)) result_add1(path, HW_PASS_DEPTH, camera_depth(camera, g.P));
    if (pass_on(HW_PASS_POSITION)) result_add3(path, HW_PASS_POSITION, g.P);
    if (pass_on(HW_PASS_OBJECT_INDEX)) result_add1(path, HW_PASS_OBJECT_INDEX, float(g.object_index));
    if (pass_on(HW_PASS_MATERIAL_INDEX))
      result_add1(path, HW_PASS_MATERIAL_INDEX, float(MaterialTable(HW_ROOT.materials).at[g.material].pass_index));
  }
  if (pass_on(HW_PASS_UV)) result_add3(path, HW_PASS_UV, vec3(g.uv, 1.0));
  if (pass_on(HW_PASS_VECTOR)) {
    vec4 v = motion_vector(g.P, previous_position(hit));
    uint o = path * HW_FRAME.film_stride + HW_FRAME.pass_offset[HW_PASS_VECTOR];
    FloatBuffer r = FloatBuffer(HW_FRAME.results);
    r.at[o] += v.x;
    r.at[o + 1u] += v.y;
    r.at[o + 2u] += v.z;
    r.at[o + 3u] += v.w;
  }
  if (pass_on(HW_PASS_NORMAL)) result_add3(path, HW_PASS_NORMAL, closures_normal(list, sg));
}

// Of every surface seen straight or through transparent ones, by its share. The mist pass starts at 1 and gives way.
void write_share_passes(uint path, PathState state, SurfaceGeometry g, ClosureList list, ShadingGeometry sg, vec3 alpha) {
  const uint colour_passes =
      1u << HW_PASS_DIFFUSE_COLOR | 1u << HW_PASS_GLOSSY_COLOR | 1u << HW_PASS_TRANSMISSION_COLOR;
  if ((HW_PASSES & colour_passes) != 0u) {
    vec3 diffuse = vec3(0.0), glossy = vec3(0.0), transmission = vec3(0.0);
    for (uint i = 0u; i < list.count; ++i) {
      Closure c = closure_load(list, i);
      bool through = closure_type(c) == HW_CLOSURE_TRANSPARENT;
      vec3 reflected = through ? vec3(0.0) : closure_albedo(c, sg.wo, true, false);
      vec3 transmitted = through ? vec3(0.0) : closure_albedo(c, sg.wo, false, true);
      bool is_diffuse = closure_is_diffuse(c);
      diffuse += is_diffuse ? reflected : vec3(0.0);
      glossy += is_diffuse ? vec3(0.0) : reflected;
      transmission += is_diffuse ? vec3(0.0) : transmitted;
    }
    vec3 t = state.throughput;
    if (pass_on(HW_PASS_DIFFUSE_COLOR)) result_add3(path, HW_PASS_DIFFUSE_COLOR, t * diffuse);
    if (pass_on(HW_PASS_GLOSSY_COLOR)) result_add3(path, HW_PASS_GLOSSY_COLOR, t * glossy);
    if (pass_on(HW_PASS_TRANSMISSION_COLOR)) result_add3(path, HW_PASS_TRANSMISSION_COLOR, t * transmission);
  }
  if (pass_on(HW_PASS_MIST)) {
    float depth = HW_FRAME.mist_inverse_depth > 0.0 ? 1.0 / HW_FRAME.mist_inverse_depth : 0.0;
    float mist = camera_mist(HW_ROOT.camera, g.P, HW_FRAME.mist_start, depth, HW_FRAME.mist_falloff);
    vec3 share = state.throughput * alpha;
    result_add1(path, HW_PASS_MIST, (mist - 1.0) * (share.x + share.y + share.z) * (1.0 / 3.0));
  }
}

// Denoising normal and albedo, at the first surface that is not mostly mirror-like: a mirror shows what it reflects.
// Cycles' rule: at least a quarter of the sample weight must be rough. The normal is in camera space,
// which looks along +Z there. The depth is that of all the way there, in metres: segments, each weighed by what mirrors
// before it leave. `segment`: the last one's length.
// Returns true when they have been written.
bool write_denoising_features(uint path, ClosureList list, ShadingGeometry sg, float segment) {
  vec3 feature = SplitArray(HW_FRAME.splits).at[path].feature;
  if (pass_on(HW_PASS_DENOISING_DEPTH))
    result_add1(path, HW_PASS_DENOISING_DEPTH, (feature.x + feature.y + feature.z) * (1.0 / 3.0) * segment);
  vec3 normal = vec3(0.0), rough = vec3(0.0), specular = vec3(0.0);
  float weight = 0.0, rough_weight = 0.0;
  bool only_transparent = true;
  for (uint i = 0u; i < list.count; ++i) {
    Closure c = closure_load(list, i);
    bool through = closure_type(c) == HW_CLOSURE_TRANSPARENT;
    only_transparent = only_transparent && through;
    bool is_rough = closure_roughness2(c) > 0.075 * 0.075;
    vec3 albedo = through ? c.weight : closure_albedo(c, sg.wo, true, true);
    normal += (through ? sg.Ns : c.N) * c.sample_weight;
    weight += c.sample_weight;
    rough_weight += is_rough ? c.sample_weight : 0.0;
    rough += is_rough ? albedo : vec3(0.0);
    specular += is_rough ? vec3(0.0) : albedo;
  }
  if (only_transparent && list.count > 0u) return false;
  if (weight > 0.0 && rough_weight * 4.0 <= weight) {
    SplitArray(HW_FRAME.splits).at[path].feature = feature * specular;
    return false;
  }
  normal = weight > 0.0 ? normal / weight : sg.Ns;
  CameraRecord camera = HW_ROOT.camera;
  vec3 x = vec3(camera.camera_to_world[0], camera.camera_to_world[4], camera.camera_to_world[8]);
  vec3 y = vec3(camera.camera_to_world[1], camera.camera_to_world[5], camera.camera_to_world[9]);
  vec3 z = vec3(camera.camera_to_world[2], camera.camera_to_world[6], camera.camera_to_world[10]);
  if (pass_on(HW_PASS_DENOISING_NORMAL))
    result_add3(path, HW_PASS_DENOISING_NORMAL, vec3(dot(x, normal), dot(y, normal), -dot(z, normal)));
  if (pass_on(HW_PASS_DENOISING_ALBEDO)) result_add3(path, HW_PASS_DENOISING_ALBEDO, feature * rough);
  return true;
}
#endif
