// SPDX-License-Identifier: Apache-2.0
// What a program can ask about the point it shades: coordinates, attributes, object, camera and ray. Semantics are those
// of Blender's input nodes. A `shift` of 1 or 2 moves the point along a tangent by part of a pixel, for bump mapping.
#ifndef HW_MATERIAL_INPUTS_GLSL
#define HW_MATERIAL_INPUTS_GLSL
#include "warp.h"
#include "hash.h"
#include "material_io.glsl"
#include "tables.glsl"
#include "words.glsl"

#define HW_INSTANCE(i) InstanceTable(HW_ROOT.instances).at[i]
#define HW_MESH(i) MeshTable(HW_ROOT.meshes).at[i]

// Tangents of the picture's pixel at the point: any two across Ng, as long as the pixel is wide.
void input_pixel_tangents(MaterialInputs m, out vec3 dx, out vec3 dy) {
  warp_frame(m.Ng, dx, dy);
  float width = m.footprint > 0.0 ? m.footprint : 1e-3;
  dx *= width;
  dy *= width;
}

// A matrix of the instance, row-major 3x4.
const uint HW_INPUT_OBJECT_TO_WORLD = 0u;
const uint HW_INPUT_WORLD_TO_OBJECT = 6u;  // in 64-bit words
float[12] input_matrix(uint instance, uint first) {
  uint64_t w = HW_ROOT.instances + uint64_t(instance) * HW_INSTANCE_BYTES + uint64_t(first) * 8ul;
  float m[12];
  for (uint i = 0u; i < 6u; ++i) {
    uint64_t pair = word_at(w, i);
    m[2u * i] = word_low_float(pair);
    m[2u * i + 1u] = word_high_float(pair);
  }
  return m;
}

// Two edges of the triangle in object space.
void input_edges(uint mesh, uint primitive, out vec3 e1, out vec3 e2) {
  uvec3 v = word_triple(HW_MESH(mesh).tri_vertices, primitive);
  uint64_t positions = HW_MESH(mesh).positions;
  vec3 p0 = word_vector(positions, v.x);
  e1 = word_vector(positions, v.y) - p0;
  e2 = word_vector(positions, v.z) - p0;
}

// Barycentrics (v, w of the second and third vertex) of the shifted point.
vec2 input_barycentrics(MaterialInputs m, vec3 offset) {
  vec2 b = vec2(m.bary_u, m.bary_v);
  if (dot(offset, offset) > 0.0 && m.instance != HW_NONE) {
    vec3 e1, e2;
    input_edges(HW_INSTANCE(m.instance).mesh, m.primitive, e1, e2);
    float t[12] = input_matrix(m.instance, HW_INPUT_WORLD_TO_OBJECT);
    vec3 d = HW_TRANSFORM_VECTOR(t, offset);
    float a = dot(e1, e1), c = dot(e2, e2), k = dot(e1, e2);
    float det = a * c - k * k;
    float x = dot(d, e1), y = dot(d, e2);
    b += det > 0.0 ? vec2(c * x - k * y, a * y - k * x) / det : vec2(0.0);
  }
  return b;
}

// Index of the mesh's attribute with this hash, HW_NONE if it has none.
uint input_find_attribute(uint mesh, uint name) {
  uint found = HW_NONE;
  uint count = min(HW_MESH(mesh).attribute_count, HW_MAX_ATTRIBUTES);
  for (uint i = 0u; i < count && found == HW_NONE; ++i) {
    if (HW_MESH(mesh).attributes[i].name == name) { found = i; }
  }
  return found;
}

// Element indices of the triangle's corners in an attribute.
uvec3 input_elements(uint mesh, uint domain, uint primitive) {
  uint64_t corners = domain == HW_DOMAIN_CORNER ? HW_MESH(mesh).tri_corners : 0ul;
  bool in_order = corners == uint64_t(HW_CORNERS_IN_ORDER);
  uvec3 e = word_triple(corners != 0ul && !in_order ? corners : HW_MESH(mesh).tri_vertices, primitive);
  if (in_order) { e = uvec3(0u, 1u, 2u) + 3u * primitive; }
  return domain == HW_DOMAIN_FACE ? uvec3(primitive) : e;
}

// One element: a single component is kept in x, y and z; a missing alpha is 1.
vec4 input_element(uint64_t data, uint components, uint index) {
  uint base = index * components;
  uint64_t first = data + uint64_t(base >> 1u) * 8ul;
  vec2 xy = word_floats(word_at(first, 0u));
  bool odd = (base & 1u) != 0u;
  if (components == 1u) {
    float x = odd ? xy.y : xy.x;
    return vec4(x, x, x, 1.0);
  }
  if (odd) { xy = vec2(xy.y, word_low_float(word_at(first, 1u))); }
  vec2 zw = vec2(0.0, 1.0);
  if (components > 2u) {
    // The third lies in either half; a fourth only follows where it is the lower.
    vec2 pair = word_floats(word_at(data, (base + 2u) >> 1u));
    zw = vec2(odd ? pair.y : pair.x, components > 3u ? pair.y : 1.0);
  }
  return vec4(xy, zw);
}

vec4 input_interpolated(uint mesh, uint index, uint primitive, vec2 b) {
  uint64_t data = HW_MESH(mesh).attributes[index].data;
  uint components = HW_MESH(mesh).attributes[index].components;
  uvec3 e = input_elements(mesh, HW_MESH(mesh).attributes[index].domain, primitive);
  return input_element(data, components, e.x) * (1.0 - b.x - b.y) + input_element(data, components, e.y) * b.x +
         input_element(data, components, e.z) * b.y;
}

// Object-space tangent of a UV map over the triangle (direction of growing u) and in w the handedness of the map.
vec4 input_uv_tangent(uint mesh, uint index, uint primitive) {
  uint64_t data = HW_MESH(mesh).attributes[index].data;
  uint components = HW_MESH(mesh).attributes[index].components;
  uvec3 e = input_elements(mesh, HW_MESH(mesh).attributes[index].domain, primitive);
  vec2 uv0 = word_two_floats(data, e.x * components);
  vec2 d1 = word_two_floats(data, e.y * components) - uv0;
  vec2 d2 = word_two_floats(data, e.z * components) - uv0;
  vec3 e1, e2;
  input_edges(mesh, primitive, e1, e2);
  float det = d1.x * d2.y - d1.y * d2.x;
  vec3 t = (e1 * d2.y - e2 * d1.y) * (det < 0.0 ? -1.0 : 1.0);
  float length2 = dot(t, t);
  return det != 0.0 && length2 > 0.0 ? vec4(t * inversesqrt(length2), det < 0.0 ? -1.0 : 1.0) : vec4(0.0);
}

// The tangent attribute `name` (three or four components, the last a sign) or, without it, the default UV map's own.
// Zero where the mesh has neither.
vec4 input_tangent(MaterialInputs m, uint name) {
  vec4 t = vec4(0.0);
  if (m.instance != HW_NONE) {
    uint mesh = HW_INSTANCE(m.instance).mesh;
    uint index = name != 0u ? input_find_attribute(mesh, name) : HW_NONE;
    if (index != HW_NONE) {
      t = input_interpolated(mesh, index, m.primitive, vec2(m.bary_u, m.bary_v));
      t.w = t.w < 0.0 ? -1.0 : 1.0;
    } else {
      int uv = HW_MESH(mesh).default_uv;
      if (uv >= 0) { t = input_uv_tangent(mesh, uint(uv), m.primitive); }
    }
  }
  return t;
}

// Camera space with Blender's shading axes: x right, y up, z into the picture.
vec3 input_to_camera(vec3 v) {
  return vec3(HW_ROOT.camera.camera_to_world[0] * v.x + HW_ROOT.camera.camera_to_world[4] * v.y + HW_ROOT.camera.camera_to_world[8] * v.z,
              HW_ROOT.camera.camera_to_world[1] * v.x + HW_ROOT.camera.camera_to_world[5] * v.y + HW_ROOT.camera.camera_to_world[9] * v.z,
              -(HW_ROOT.camera.camera_to_world[2] * v.x + HW_ROOT.camera.camera_to_world[6] * v.y + HW_ROOT.camera.camera_to_world[10] * v.z));
}
vec3 input_from_camera(vec3 v) {
  vec3 c = vec3(v.x, v.y, -v.z);
  return HW_TRANSFORM_VECTOR(HW_ROOT.camera.camera_to_world, c);
}
vec3 input_camera_origin() {
  return vec3(HW_ROOT.camera.camera_to_world[3], HW_ROOT.camera.camera_to_world[7], HW_ROOT.camera.camera_to_world[11]);
}

// HW_OP_TRANSFORM. Vectors keep their length; normals are turned by the inverse transpose and are unit.
vec3 input_transform(MaterialInputs m, uint sub, vec3 v) {
  uint from = sub & 3u;
  uint to = (sub >> 2u) & 3u;
  uint kind = sub >> 4u;
  bool has = m.instance != HW_NONE;
  vec3 world = v;
  if (from == HW_SPACE_CAMERA) { world = input_from_camera(v) + (kind == HW_TRANSFORM_AS_POINT ? input_camera_origin() : vec3(0.0)); }
  if (from == HW_SPACE_OBJECT && has) {
    bool normal = kind == HW_TRANSFORM_AS_NORMAL;
    float t[12] = input_matrix(m.instance, normal ? HW_INPUT_WORLD_TO_OBJECT : HW_INPUT_OBJECT_TO_WORLD);
    vec3 linear = HW_TRANSFORM_VECTOR(t, v);
    vec3 transposed = HW_TRANSFORM_TRANSPOSED(t, v);
    vec3 offset = vec3(t[3], t[7], t[11]);
    world = normal ? transposed : (kind == HW_TRANSFORM_AS_POINT ? linear + offset : linear);
  }
  vec3 r = world;
  if (to == HW_SPACE_CAMERA) { r = input_to_camera(kind == HW_TRANSFORM_AS_POINT ? world - input_camera_origin() : world); }
  if (to == HW_SPACE_OBJECT && has) {
    bool normal = kind == HW_TRANSFORM_AS_NORMAL;
    float t[12] = input_matrix(m.instance, normal ? HW_INPUT_OBJECT_TO_WORLD : HW_INPUT_WORLD_TO_OBJECT);
    vec3 linear = HW_TRANSFORM_VECTOR(t, world);
    vec3 transposed = HW_TRANSFORM_TRANSPOSED(t, world);
    vec3 offset = vec3(t[3], t[7], t[11]);
    r = normal ? transposed : (kind == HW_TRANSFORM_AS_POINT ? linear + offset : linear);
  }
  float length2 = dot(r, r);
  return kind == HW_TRANSFORM_AS_NORMAL && length2 > 0.0 ? r * inversesqrt(length2) : r;
}

// HW_OP_ATTRIBUTE.
vec3 input_attribute(MaterialInputs m, uint name, uint sub, vec3 offset) {
  vec3 r = vec3(0.0);
  uint kind = sub & 255u;
  if (m.instance != HW_NONE) {
    uint mesh = HW_INSTANCE(m.instance).mesh;
    if (kind == HW_ATTRIBUTE_TANGENT) {
      // Turned as a normal and made to lie in the surface, as Blender's Tangent node does.
      vec3 t = input_transform(m, HW_SPACE_OBJECT | HW_TRANSFORM_AS_NORMAL << 4u, input_tangent(m, name).xyz);
      vec3 side = cross(m.N, cross(t, m.N));
      float length2 = dot(side, side);
      r = length2 > 0.0 ? side * inversesqrt(length2) : vec3(0.0);
    } else {
      uint index = input_find_attribute(mesh, name);
      if (index != HW_NONE) {
        vec4 v = input_interpolated(mesh, index, m.primitive, input_barycentrics(m, offset));
        r = kind == HW_ATTRIBUTE_VALUE ? v.xyz : vec3(kind == HW_ATTRIBUTE_ALPHA ? v.w : 1.0);
      }
    }
  }
  return r;
}

float input_bit(uint flags, uint bit) { return (flags & bit) != 0u ? 1.0 : 0.0; }

// HW_OP_INPUT for what needs no table: rays and directions.
vec3 input_ray(MaterialInputs m, uint kind) {
  uint f = m.ray_flags;
  vec3 r = vec3(0.0);
  if (kind == HW_INPUT_IS_CAMERA_SHADOW_DIFFUSE)
    r = vec3(input_bit(f, HW_PATH_CAMERA), input_bit(f, HW_PATH_SHADOW), input_bit(f, HW_PATH_DIFFUSE));
  if (kind == HW_INPUT_IS_GLOSSY_SINGULAR_REFLECTION)
    r = vec3(input_bit(f, HW_PATH_GLOSSY), input_bit(f, HW_PATH_SINGULAR), input_bit(f, HW_PATH_REFLECTION));
  if (kind == HW_INPUT_IS_TRANSMISSION_VOLUME_BACKFACING)
    r = vec3(input_bit(f, HW_PATH_TRANSMISSION), 0.0, input_bit(m.shade_flags, HW_SHADE_BACKFACING));
  // A shadow ray's surface lies one bounce further than its path.
  float depth = float(m.bounces & 255u) + input_bit(f, HW_PATH_SHADOW);
  if (kind == HW_INPUT_RAY_LENGTH_DEPTH_DIFFUSE) r = vec3(m.ray_length, depth, float((m.bounces >> 8u) & 255u));
  if (kind == HW_INPUT_DEPTH_GLOSSY_TRANSPARENT_TRANSMISSION)
    r = vec3(float((m.bounces >> 16u) & 255u), float(m.transparent), float(m.bounces >> 24u));
  return r;
}

// HW_OP_INPUT; `offset` is the shift in world space.
vec3 input_value(MaterialInputs m, uint kind, vec3 offset) {
  bool has = m.instance != HW_NONE;
  vec3 P = m.P + offset;
  vec3 r = input_ray(m, kind);
  if (kind == HW_INPUT_UV) {
    r = m.uv;
    if (has && dot(offset, offset) > 0.0) {
      uint mesh = HW_INSTANCE(m.instance).mesh;
      int uv = HW_MESH(mesh).default_uv;
      if (uv >= 0) { r = vec3(input_interpolated(mesh, uint(uv), m.primitive, input_barycentrics(m, offset)).xy, 0.0); }
    }
  }
  if (kind == HW_INPUT_POSITION) { r = P; }
  if (kind == HW_INPUT_NORMAL) { r = m.N; }
  if (kind == HW_INPUT_TRUE_NORMAL) { r = m.Ng; }
  if (kind == HW_INPUT_PARAMETRIC) {
    vec2 b = input_barycentrics(m, offset);
    r = vec3(1.0 - b.x - b.y, b.x, 0.0);
  }
  if (kind == HW_INPUT_REFLECTION) { r = has ? 2.0 * dot(m.N, m.wo) * m.N - m.wo : m.wo; }
  if (kind == HW_INPUT_GENERATED || kind == HW_INPUT_OBJECT) {
    r = P;
    if (has) {
      float t[12] = input_matrix(m.instance, HW_INPUT_WORLD_TO_OBJECT);
      vec3 o = HW_TRANSFORM_POINT(t, P);
      r = kind == HW_INPUT_OBJECT ? o : (o - HW_INSTANCE(m.instance).generated_min) * HW_INSTANCE(m.instance).generated_scale;
    }
  }
  if (kind == HW_INPUT_OBJECT_NORMAL) { r = input_transform(m, HW_SPACE_OBJECT << 2u | HW_TRANSFORM_AS_NORMAL << 4u, m.N); }
  if (kind >= HW_INPUT_RADIAL_X && kind <= HW_INPUT_RADIAL_Z) {
    vec3 g = P;
    if (has) {
      float t[12] = input_matrix(m.instance, HW_INPUT_WORLD_TO_OBJECT);
      vec3 o = HW_TRANSFORM_POINT(t, P);
      g = (o - HW_INSTANCE(m.instance).generated_min) * HW_INSTANCE(m.instance).generated_scale;
    }
    vec3 d = g - vec3(0.5);
    vec3 t = kind == HW_INPUT_RADIAL_X ? vec3(0.0, -d.z, d.y) : (kind == HW_INPUT_RADIAL_Y ? vec3(-d.z, 0.0, d.x) : vec3(-d.y, d.x, 0.0));
    t = input_transform(m, HW_SPACE_OBJECT | HW_TRANSFORM_AS_NORMAL << 4u, t);
    vec3 side = cross(m.N, cross(t, m.N));
    float length2 = dot(side, side);
    r = length2 > 0.0 ? side * inversesqrt(length2) : vec3(0.0);
  }
  if (kind == HW_INPUT_TANGENT) { r = input_attribute(m, 0u, HW_ATTRIBUTE_TANGENT, vec3(0.0)); }
  if (kind == HW_INPUT_OBJECT_LOCATION && has) {
    r = vec3(HW_INSTANCE(m.instance).object_to_world[3], HW_INSTANCE(m.instance).object_to_world[7], HW_INSTANCE(m.instance).object_to_world[11]);
  }
  if (kind == HW_INPUT_OBJECT_COLOR && has) { r = HW_INSTANCE(m.instance).color; }
  if (kind == HW_INPUT_OBJECT_DATA && has) {
    r = vec3(float(HW_INSTANCE(m.instance).object_index), unit_float(HW_INSTANCE(m.instance).random_id),
             float(MaterialTable(HW_ROOT.materials).at[m.material].pass_index));
  }
  if (kind == HW_INPUT_CAMERA || kind == HW_INPUT_CAMERA_VECTOR || kind == HW_INPUT_CAMERA_DEPTH || kind == HW_INPUT_WINDOW) {
    // A background is infinitely far: its point is a direction.
    vec3 c = input_to_camera(has ? P - input_camera_origin() : P);
    float distance_ = length(c);
    r = c;
    if (kind == HW_INPUT_CAMERA_VECTOR) { r = distance_ > 0.0 ? c / distance_ : vec3(0.0); }
    if (kind == HW_INPUT_CAMERA_DEPTH) { r = vec3(c.z, distance_, 0.0); }
    if (kind == HW_INPUT_WINDOW) {
      bool perspective = HW_ROOT.camera.type == HW_CAMERA_PERSPECTIVE;
      vec2 plane = perspective ? c.xy / (c.z != 0.0 ? c.z : 1.0) : c.xy;
      vec2 low = vec2(HW_ROOT.camera.left, HW_ROOT.camera.bottom);
      vec2 high = vec2(HW_ROOT.camera.right, HW_ROOT.camera.top);
      r = vec3((plane - low) / (high - low), 0.0);
    }
  }
  return r;
}

// Object-space normal that a tangent-space map bends: interpolated between the corners and not made unit, as the maps are
// baked for; the geometric one of a flat triangle.
vec3 input_baked_normal(MaterialInputs m) {
  uint mesh = HW_INSTANCE(m.instance).mesh;
  uint64_t normals = HW_MESH(mesh).normals;
  uint64_t data = normals != 0ul ? normals : HW_MESH(mesh).positions;
  uvec3 e = input_elements(mesh, normals != 0ul ? HW_DOMAIN_CORNER : HW_DOMAIN_VERTEX, m.primitive);
  vec3 a = word_vector(data, e.x), b = word_vector(data, e.y), c = word_vector(data, e.z);
  vec3 smooth_ = a * (1.0 - m.bary_u - m.bary_v) + b * m.bary_u + c * m.bary_v;
  vec3 flat_ = cross(b - a, c - a);
  float length2 = dot(flat_, flat_);
  return normals != 0ul ? smooth_ : (length2 > 0.0 ? flat_ * inversesqrt(length2) : vec3(0.0));
}

// HW_OP_NORMAL_MAP; imm is the hash of the tangent attribute.
vec3 input_normal_map(MaterialInputs m, uint space, uint tangent_name, vec3 color, float strength, vec3 fallback) {
  vec3 t = 2.0 * color - vec3(1.0);
  float facing = (m.shade_flags & HW_SHADE_BACKFACING) != 0u ? -1.0 : 1.0;
  vec3 N = t;
  bool valid = m.instance != HW_NONE;
  if (space == HW_NORMAL_MAP_TANGENT) {
    vec4 tangent = input_tangent(m, tangent_name);
    valid = valid && dot(tangent.xyz, tangent.xyz) > 0.0;
    vec3 n = valid ? input_baked_normal(m) : vec3(0.0);
    vec3 b = cross(n, tangent.xyz) * tangent.w;
    vec3 local = vec3(t.xy * strength, mix(1.0, t.z, clamp(strength, 0.0, 1.0)));
    N = tangent.xyz * local.x + b * local.y + n * local.z;
  }
  if (space != HW_NORMAL_MAP_WORLD) { N = input_transform(m, HW_SPACE_OBJECT | HW_TRANSFORM_AS_NORMAL << 4u, N); }
  float length2 = dot(N, N);
  N = length2 > 0.0 ? N * (facing * inversesqrt(length2)) : m.N;
  if (space != HW_NORMAL_MAP_TANGENT) {
    vec3 blended = fallback + (N - fallback) * max(strength, 0.0);
    float blended2 = dot(blended, blended);
    N = blended2 > 0.0 ? blended * inversesqrt(blended2) : fallback;
  }
  // Not equal to itself: not a number.
  return valid && dot(N, N) > 0.0 ? N : fallback;
}
#endif
