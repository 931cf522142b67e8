// SPDX-License-Identifier: Apache-2.0
// Runs material programs (shared/material_program.h). One loop per tier, dearer tiers outside: rows of a tier run until
// one of another tier comes, so that an implementation that executes both sides of every branch pays for images and noise
// once per such row. What a scene's programs do not use is compiled out by HW_FEATURES; procedural textures are only in
// the kernel variants that define HW_VM_PROCEDURAL, since a driver reads all of a kernel before it drops anything.
//
//   material_eval          surface section: closures, emission, transparency, holdout
//   material_emission      emission section, or the material's constant
//   material_transparency  transparency section; opaque without one
#ifndef HW_MATERIAL_VM_GLSL
#define HW_MATERIAL_VM_GLSL
#include "material_io.glsl"
#include "color_ops.h"
#include "equirect.h"
#include "fresnel.h"
#include "material_inputs.glsl"
#include "math_ops.h"
#include "textures.glsl"
#include "words.glsl"
#ifdef HW_VM_PROCEDURAL
#include "noise.h"
#include "patterns.h"
#include "voronoi.h"
#endif

#define HW_VM_HAS(family) HW_HAS((family) << HW_FEATURE_VM_SHIFT)

vec3 vm_registers[HW_VM_REGISTERS];
uint64_t vm_words;      // the program's first word
uint64_t vm_constants;  // vec4[]: the material's constants
uint vm_pc;             // row that `vm_row` holds
uvec4 vm_row;

void vm_fetch() {
  uint64_t first = word_at(vm_words, 2u * vm_pc), second = word_at(vm_words, 2u * vm_pc + 1u);
  vm_row = uvec4(word_low(first), word_high(first), word_low(second), word_high(second));
}
void vm_next() {
  vm_pc += 1u;
  vm_fetch();
}
uint vm_op() { return vm_row.x & 255u; }
uint vm_sub() { return vm_row.x >> 16u; }

vec3 vm_read(uint operand) {
  vec3 r = vm_registers[operand & (HW_VM_REGISTERS - 1u)];
  if ((operand & HW_OPERAND_CONSTANT) != 0u) {
    uint i = 2u * (operand & 0x7FFFu);
    r = vec3(word_floats(word_at(vm_constants, i)), word_low_float(word_at(vm_constants, i + 1u)));
  }
  return r;
}
vec3 vm_a() { return vm_read(vm_row.y & 0xFFFFu); }
vec3 vm_b() { return vm_read(vm_row.y >> 16u); }
vec3 vm_c() { return vm_read(vm_row.z & 0xFFFFu); }
vec3 vm_d() { return vm_read(vm_row.z >> 16u); }
vec3 vm_e() { return vm_read(vm_row.w & 0xFFFFu); }
vec3 vm_f() { return vm_read(vm_row.w >> 16u); }

// One component of HW_OP_TABLE.
float vm_table(uint first, uint sub, float x, uint component) {
  float last = float(sub & HW_TABLE_ENTRIES);
  bool beyond = (sub & HW_TABLE_EXTRAPOLATE) != 0u && (x < 0.0 || x > 1.0);
  float at = clamp(x, 0.0, 1.0) * last;
  at = at >= 0.0 ? at : 0.0;
  float low = min(floor(at), max(last - 1.0, 0.0));
  float f = at - low;
  if ((sub & HW_TABLE_STEP) != 0u) { low = floor(at); }
  uint i = first + uint(low);
  uint j = first + uint(min(low + 1.0, last));
  float v0 = float_at(vm_constants, 4u * i + component);
  float v1 = float_at(vm_constants, 4u * j + component);
  float t = beyond ? x * last - low : ((sub & HW_TABLE_STEP) != 0u ? 0.0 : f);
  return v0 + (v1 - v0) * t;
}

void vm_lookup(MaterialInputs m) {
  uint op = vm_op();
  uint sub = vm_sub();
  uint imm = vm_row.w;
  vec3 a = vm_a();
  vec3 b = vm_b();
  vec3 r = vec3(0.0);
  if (HW_VM_HAS(HW_VM_MATH)) {
    if (op == HW_OP_MATH) { r = vec3(scalar_function(sub, a.x, b.x)); }
    if (op == HW_OP_MATRIX) {
      Vec4Array rows = Vec4Array(vm_constants);
      vec4 p = vec4(a, 1.0);
      r = vec3(dot(rows.at[imm], p), dot(rows.at[imm + 1u], p), dot(rows.at[imm + 2u], p));
    }
    if (op == HW_OP_FRESNEL) {
      float eta = max(a.x, 1e-5);
      float cos_t;
      float cosine = dot(m.wo, b);
      float f = fresnel_dielectric(cosine, (m.shade_flags & HW_SHADE_BACKFACING) != 0u ? 1.0 / eta : eta, cos_t);
      r = vec3(sub == 1u ? abs(cosine) : f);
    }
  }
  if (HW_VM_HAS(HW_VM_TABLE)) {
    if (op == HW_OP_TABLE) {
      bool alpha = (sub & HW_TABLE_ALPHA) != 0u;
      r.x = vm_table(imm, sub, a.x, alpha ? 3u : 0u);
      r.y = vm_table(imm, sub, a.y, alpha ? 3u : 1u);
      r.z = vm_table(imm, sub, a.z, alpha ? 3u : 2u);
    }
  }
  if (HW_VM_HAS(HW_VM_INPUT)) {
    uint shift = (sub >> 8u) & 3u;
    vec3 dx, dy;
    input_pixel_tangents(m, dx, dy);
    vec3 offset = shift == 0u ? vec3(0.0) : (shift == 1u ? dx : dy) * a.x;
    if (op == HW_OP_INPUT) { r = input_value(m, sub & 255u, offset); }
    if (op == HW_OP_ATTRIBUTE) { r = input_attribute(m, imm, sub, offset); }
    if (op == HW_OP_TRANSFORM) { r = input_transform(m, sub, a); }
  }
  if (HW_VM_HAS(HW_VM_COLOR)) {
    if (op == HW_OP_COLOR) { r = color_convert(sub, a); }
  }
  if (HW_VM_HAS(HW_VM_IMAGE)) {
    if (op == HW_OP_IMAGE) {
      vec4 texel = image_texture(imm, sub, a, b);
      r = texel.xyz;
      uint alpha = vm_row.z >> 16u;
      if (alpha >= HW_REGISTER_FIRST_FREE) { vm_registers[alpha & (HW_VM_REGISTERS - 1u)] = vec3(texel.w); }
    }
    if (op == HW_OP_ENVIRONMENT) {
      float length2 = dot(a, a);
      vec2 uv = sub == 0u ? equirect_from_direction(a * (length2 > 0.0 ? inversesqrt(length2) : 0.0)) : mirror_ball_from_direction(a);
      r = vec3(sub == 0u && length2 == 0.0 ? vec2(0.0) : uv, 0.0);
    }
  }
  vm_registers[(vm_row.x >> 8u) & (HW_VM_REGISTERS - 1u)] = r;
}

void vm_normal(MaterialInputs m) {
  vec3 a = vm_a();
  vec3 b = vm_b();
  vec3 c = vm_c();
  vec3 r = vec3(0.0);
  if (vm_op() == HW_OP_BUMP) {
    vec3 dx, dy;
    input_pixel_tangents(m, dx, dy);
    r = bump_normal(a, dx, dy, c, b.x, b.y, b.z);
  }
  if (vm_op() == HW_OP_NORMAL_MAP) { r = input_normal_map(m, vm_sub(), vm_row.w, a, b.x, c); }
  vm_registers[(vm_row.x >> 8u) & (HW_VM_REGISTERS - 1u)] = r;
}

#ifdef HW_VM_PROCEDURAL
void vm_procedural() {
  uint op = vm_op();
  uint sub = vm_sub();
  vec3 a = vm_a();
  vec3 b = vm_b();
  vec3 r = vec3(0.0);
  if (HW_VM_HAS(HW_VM_NOISE)) {
    if (op == HW_OP_NOISE) { r = noise_texture(sub, a, b, vm_c(), vm_d().x); }
  }
  if (HW_VM_HAS(HW_VM_VORONOI)) {
    if (op == HW_OP_VORONOI) { r = voronoi_texture(sub, a, b, vm_c(), vm_d().x); }
  }
  if (HW_VM_HAS(HW_VM_PATTERN)) {
    if (op == HW_OP_WHITE_NOISE) { r = white_noise(sub, a, b.x); }
    if (op == HW_OP_MAGIC) { r = magic_texture(sub, a, vm_c().x, b.x); }
    if (op == HW_OP_BRICK) { r = brick_texture(sub, a, b, vm_c(), vm_d().x); }
  }
  vm_registers[(vm_row.x >> 8u) & (HW_VM_REGISTERS - 1u)] = r;
}
#endif

// Runs the value rows of a section; `vm_row` is then its first closure row, or its end. False: the section is empty.
bool vm_values(MaterialInputs m, uint section) {
  uint64_t material = HW_ROOT.materials + uint64_t(m.material) * HW_MATERIAL_BYTES;
  uint64_t program = word_at(material, 0u);
  vm_words = HW_ROOT.programs + uint64_t(word_low(program)) * 4ul;
  vm_constants = HW_ROOT.constants + uint64_t(word_low(word_at(material, 1u))) * 16ul;
  bool any = word_high(program) > 0u;
  vm_pc = 0u;
  if (any) { vm_pc = uint_at(vm_words, section); }
  any = vm_pc != 0u;
  vm_row = uvec4(HW_OP_END, 0u, 0u, 0u);
  if (any) { vm_fetch(); }
  vm_registers[HW_REGISTER_UV] = m.uv;
  vm_registers[HW_REGISTER_POSITION] = m.P;
  vm_registers[HW_REGISTER_NORMAL] = m.N;
  vm_registers[HW_REGISTER_INCOMING] = m.wo;
  do {
    do {
      do {
        do {
          if (vm_op() < HW_TIER_CORE_END) {
            vm_registers[(vm_row.x >> 8u) & (HW_VM_REGISTERS - 1u)] = core_op(vm_op(), vm_sub(), vm_a(), vm_b(), vm_c());
            vm_next();
          }
        } while (vm_op() < HW_TIER_CORE_END);
        if (HW_VM_HAS(HW_VM_MATH | HW_VM_TABLE | HW_VM_INPUT | HW_VM_IMAGE | HW_VM_COLOR)) {
          if (vm_op() < HW_TIER_NORMAL) {
            vm_lookup(m);
            vm_next();
          }
        }
      } while (vm_op() < HW_TIER_NORMAL);
      if (HW_VM_HAS(HW_VM_NORMAL)) {
        if (vm_op() < HW_TIER_LOOKUP_END) {
          vm_normal(m);
          vm_next();
        }
      }
    } while (vm_op() < HW_TIER_LOOKUP_END);
#ifdef HW_VM_PROCEDURAL
    if (HW_VM_HAS(HW_VM_NOISE | HW_VM_VORONOI | HW_VM_PATTERN)) {
      if (vm_op() < HW_TIER_PROCEDURAL_END) {
        vm_procedural();
        vm_next();
      }
    }
#endif
  } while (vm_op() < HW_TIER_PROCEDURAL_END);
  return any;
}

// HW_OP_PRINCIPLED and its two rows of arguments; returns the emission.
vec3 vm_principled(ShadingGeometry g, inout ClosureList list) {
  PrincipledInputs p;
  uint sub = vm_sub();
  vec3 b = vm_b(), d = vm_d(), f = vm_f();
  float weight = vm_e().x;
  p.multiscatter = sub & 1u;
  p.base_color = vm_a();
  p.metallic = b.x;
  p.roughness = b.y;
  p.ior = b.z;
  p.normal = vm_c();
  p.alpha = d.x;
  p.diffuse_roughness = d.y;
  p.subsurface_weight = d.z;
  p.specular_ior_level = f.x;
  p.anisotropic = f.y;
  p.anisotropic_rotation = f.z;
  vm_next();
  vec3 c = vm_c();
  d = vm_d();
  p.specular_tint = vm_a();
  p.tangent = vm_b();
  p.transmission_weight = c.x;
  p.thin_film_thickness = c.y;
  p.thin_film_ior = c.z;
  p.coat_weight = d.x;
  p.coat_roughness = d.y;
  p.coat_ior = d.z;
  p.coat_tint = vm_e();
  p.coat_normal = vm_f();
  vm_next();
  vec3 a = vm_a();
  p.sheen_weight = a.x;
  p.sheen_roughness = a.y;
  p.emission_strength = a.z;
  p.sheen_tint = vm_b();
  p.emission_color = vm_c();
  return closures_add_principled(list, g, weight, p);
}

// A closure row of a node other than Principled.
void vm_closure(ShadingGeometry g, inout ClosureList list) {
  uint op = vm_op();
  uint sub = vm_sub();
  vec3 color = vm_a();
  vec3 b = vm_b();
  vec3 N = vm_c();
  float weight = vm_e().x;
  if (op == HW_OP_DIFFUSE) { closures_add_diffuse(list, g, weight, color, b.x, N); }
  if (HW_VM_HAS(HW_VM_BSDF)) {
    uint multiscatter = (sub & 3u) == HW_DISTRIBUTION_MULTI_GGX ? 1u : 0u;
    if (HW_HAS(HW_FEATURE_TRANSLUCENT)) {
      if (op == HW_OP_TRANSLUCENT) { closures_add_translucent(list, g, weight, color, N); }
    }
    if (HW_HAS(HW_FEATURE_GLOSSY)) {
      if (op == HW_OP_GLOSSY) { closures_add_glossy(list, g, weight, color, b.x, b.y, b.z, N, vm_d(), multiscatter); }
    }
    if (HW_HAS(HW_FEATURE_METALLIC)) {
      if (op == HW_OP_METALLIC && (sub & HW_METALLIC_CONDUCTOR) == 0u)
        closures_add_metallic_f82(list, g, weight, color, vm_f(), b.x, b.y, b.z, N, vm_d(), multiscatter);
    }
    if (HW_HAS(HW_FEATURE_CONDUCTOR)) {
      if (op == HW_OP_METALLIC && (sub & HW_METALLIC_CONDUCTOR) != 0u)
        closures_add_metallic_conductor(list, g, weight, color, vm_f(), b.x, b.y, b.z, N, vm_d(), multiscatter);
    }
    if (HW_HAS(HW_FEATURE_TRANSMISSION)) {
      if (op == HW_OP_GLASS) { closures_add_glass(list, g, weight, color, b.x, b.y, N, multiscatter); }
      if (op == HW_OP_REFRACTION) { closures_add_refraction(list, g, weight, color, b.x, b.y, N); }
    }
    if (HW_HAS(HW_FEATURE_SHEEN)) {
      if (op == HW_OP_SHEEN) { closures_add_sheen(list, g, weight, color, b.x, N); }
    }
    if (HW_HAS(HW_FEATURE_TOON)) {
      if (op == HW_OP_TOON) { closures_add_toon(list, g, weight, color, b.x, b.y, sub, N); }
    }
  }
}

ShadingGeometry vm_geometry(MaterialInputs m) {
  ShadingGeometry g;
  g.wo = m.wo;
  g.Ng = m.Ng;
  g.Ns = m.N;
  g.flags = m.shade_flags;
  return g;
}

// Runs the surface section of m.material. `result.closures` must be an empty list; it is finished on return (transparency
// is its last record). Everything else in `result` is overwritten.
void material_eval(MaterialInputs m, inout ShaderOutput result) {
  result.emission = vec3(0.0);
  result.holdout = vec3(0.0);
  ShadingGeometry g = vm_geometry(m);
  vm_values(m, HW_SECTION_SURFACE);
  while (vm_op() != HW_OP_END) {
    uint op = vm_op();
    vec3 a = vm_a();
    if (op == HW_OP_EMISSION) { result.emission += a; }
    if (op == HW_OP_HOLDOUT) { result.holdout += a; }
    if (op == HW_OP_TRANSPARENT) { closures_add_transparent(result.closures, 1.0, a); }
    if (op >= HW_OP_DIFFUSE && op < HW_OP_PRINCIPLED) { vm_closure(g, result.closures); }
    if (HW_VM_HAS(HW_VM_PRINCIPLED)) {
      if (op == HW_OP_PRINCIPLED) { result.emission += vm_principled(g, result.closures); }
    }
    vm_next();
  }
  result.transparency = result.closures.transparent;
  closures_finish(result.closures);
}

// Radiance towards m.wo by the emission section: of a surface (light sampling), or of a background.
vec3 material_emission(MaterialInputs m) {
  vec3 emission = vec3(0.0);
  bool any = vm_values(m, HW_SECTION_EMISSION);
  while (vm_op() != HW_OP_END) {
    uint op = vm_op();
    if (op == HW_OP_EMISSION) { emission += vm_a(); }
    // Emission under a coat or sheen layer: the layers are built to no effect (a full list takes no more records).
    if (HW_VM_HAS(HW_VM_PRINCIPLED) && (HW_HAS(HW_FEATURE_COAT) || HW_HAS(HW_FEATURE_SHEEN))) {
      if (op == HW_OP_PRINCIPLED) {
        ClosureList none = closures_at(0ul, HW_MAX_CLOSURES);
        emission += vm_principled(vm_geometry(m), none);
      }
    }
    vm_next();
  }
  return any ? emission : MaterialTable(HW_ROOT.materials).at[m.material].emission;
}

// Share of light that passes straight through, by the transparency section.
vec3 material_transparency(MaterialInputs m) {
  vec3 transparency = vec3(0.0);
  vm_values(m, HW_SECTION_TRANSPARENCY);
  while (vm_op() != HW_OP_END) {
    if (vm_op() == HW_OP_TRANSPARENT) { transparency += vm_a(); }
    vm_next();
  }
  return transparency;
}

// Inputs of a background program, for a ray that looks along `direction` (unit).
MaterialInputs background_inputs(uint material, vec3 direction, uint ray_flags, uint bounces, uint transparent) {
  MaterialInputs m;
  m.P = direction;
  m.N = -direction;
  m.Ng = -direction;
  m.wo = -direction;
  m.uv = vec3(0.0);
  m.bary_u = 0.0;
  m.bary_v = 0.0;
  m.instance = HW_NONE;
  m.primitive = 0u;
  m.material = material;
  m.ray_flags = ray_flags & HW_PATH_RAY_TYPES;
  m.bounces = bounces;
  m.transparent = transparent;
  m.ray_length = HW_INFINITY;
  m.footprint = 0.0;
  m.shade_flags = 0u;
  return m;
}
#endif
