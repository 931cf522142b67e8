// SPDX-License-Identifier: Apache-2.0
// From a hit to the point on the surface: position, normals, UV, texture for shadow terminator offsets.
#ifndef HW_GEOMETRY_GLSL
#define HW_GEOMETRY_GLSL
#include "tables.glsl"
#include "words.glsl"

// World space; normals are unit and not yet turned to the viewer.
struct SurfaceGeometry {
  vec3 P;
  vec3 Ng;
  vec3 N;                  // interpolated; Ng for flat triangles
  vec3 terminator_offset;  // see below, for light on the side of Ng
  vec2 uv;                 // default UV map
  uint material;
  uint object_index;
  uint instance_flags;
  uint light_offset;           // as InstanceRecord
  float terminator_cutoff;     // InstanceRecord::shadow_terminator_offset
};

// What a hit reads of its InstanceRecord, in words of 64 bits: lib/words.glsl.
struct InstanceHit {
  float object_to_world[12];
  uint mesh;
  uint slot_offset;
  uint slot_count;
  uint light_offset;
  uint object_index;
  uint flags;
  float shadow_terminator_offset;
};

InstanceHit instance_load(uint instance) {
  uint64_t w = HW_ROOT.instances + uint64_t(instance) * HW_INSTANCE_BYTES;
  InstanceHit r;
  for (uint i = 0u; i < 6u; ++i) {
    uint64_t pair = word_at(w, i);
    r.object_to_world[2u * i] = word_low_float(pair);
    r.object_to_world[2u * i + 1u] = word_high_float(pair);
  }
  uint64_t mesh_slots = word_at(w, HW_INSTANCE_WORD_MESH), light_object = word_at(w, HW_INSTANCE_WORD_LIGHT);
  r.mesh = word_low(mesh_slots);
  r.slot_offset = word_high(mesh_slots);
  r.slot_count = word_low(word_at(w, HW_INSTANCE_WORD_MESH + 1u));
  r.light_offset = word_low(light_object);
  r.object_index = word_high(light_object);
  r.flags = word_high(word_at(w, HW_INSTANCE_WORD_FLAGS));
  r.shadow_terminator_offset = word_high_float(word_at(w, HW_INSTANCE_WORD_TERMINATOR));
  return r;
}

uvec3 load_triangle(uint64_t indices, uint primitive) { return word_triple(indices, primitive); }

// A triangle's corners. vertices: its tri_vertices; tri_corners: MeshRecord's.
uvec3 load_corners(uint64_t tri_corners, uvec3 vertices, uint primitive) {
  bool in_order = tri_corners == uint64_t(HW_CORNERS_IN_ORDER);
  uvec3 c = vertices;
  if (tri_corners != 0ul && !in_order) { c = load_triangle(tri_corners, primitive); }
  return in_order ? uvec3(0u, 1u, 2u) + 3u * primitive : c;
}

// Material index of a triangle of an instance; slots beyond the instance's fall to its last.
uint triangle_material(uint64_t tri_slots, uint slot_offset, uint slot_count, uint primitive) {
  uint slot = tri_slots != 0ul ? byte_at(tri_slots, primitive) : 0u;
  slot = min(slot, max(slot_count, 1u) - 1u);
  return slot_count > 0u ? uint_at(HW_ROOT.slot_materials, slot_offset + slot) : 0u;
}

// A UV map has at least two components (core/scene/validate.cpp).
vec2 load_uv(uint64_t a, uvec3 vertices, uvec3 corners, uint primitive, vec3 b) {
  uint64_t data = word_at(a, 0u);
  uint domain = word_high(word_at(a, 1u));
  uvec3 i = domain == HW_DOMAIN_CORNER ? corners : domain == HW_DOMAIN_VERTEX ? vertices : uvec3(primitive);
  i *= word_low(word_at(a, 2u));
  return b.x * word_two_floats(data, i.x) + b.y * word_two_floats(data, i.y) + b.z * word_two_floats(data, i.z);
}

// `with_uv`: the UV map is only fetched where something reads it.
SurfaceGeometry surface_geometry(Hit hit, bool with_uv) {
  SurfaceGeometry g;
  InstanceHit instance = instance_load(hit.instance);
  uint64_t mesh = HW_ROOT.meshes + uint64_t(instance.mesh) * HW_MESH_BYTES;
  float m[12] = instance.object_to_world;
  float sign_det = (instance.flags & HW_INSTANCE_MIRRORED) != 0u ? -1.0 : 1.0;
  uint64_t normals = word_at(mesh, HW_MESH_WORD_NORMALS);
  uint64_t tri_corners = word_at(mesh, HW_MESH_WORD_TRI_CORNERS);
  vec3 b = vec3(1.0 - hit.u - hit.v, hit.u, hit.v);

  uvec3 v = load_triangle(word_at(mesh, HW_MESH_WORD_TRI_VERTICES), hit.primitive);
  uvec3 c = load_corners(tri_corners, v, hit.primitive);
  uint64_t positions = word_at(mesh, HW_MESH_WORD_POSITIONS);
  vec3 q0 = word_vector(positions, v.x), q1 = word_vector(positions, v.y), q2 = word_vector(positions, v.z);
  vec3 p0 = HW_TRANSFORM_POINT(m, q0);
  vec3 p1 = HW_TRANSFORM_POINT(m, q1);
  vec3 p2 = HW_TRANSFORM_POINT(m, q2);
  g.P = p0 * b.x + p1 * b.y + p2 * b.z;
  // Object space winding decides the outside; a mirrored instance turns the world-space winding round.
  vec3 cross_product = cross(p1 - p0, p2 - p0) * sign_det;
  float area2 = dot(cross_product, cross_product);
  g.Ng = area2 > 0.0 ? cross_product * inversesqrt(area2) : vec3(0.0, 0.0, 1.0);
  g.N = g.Ng;
  g.terminator_offset = vec3(0.0);
  if (normals != 0ul) {
    // The transposed inverse times the determinant, from the columns: cheaper than loading the inverse.
    vec3 column_x = vec3(m[0], m[4], m[8]), column_y = vec3(m[1], m[5], m[9]), column_z = vec3(m[2], m[6], m[10]);
    vec3 cofactor_x = cross(column_y, column_z) * sign_det;
    vec3 cofactor_y = cross(column_z, column_x) * sign_det;
    vec3 cofactor_z = cross(column_x, column_y) * sign_det;
    vec3 o0 = word_vector(normals, c.x), o1 = word_vector(normals, c.y), o2 = word_vector(normals, c.z);
    vec3 n0 = cofactor_x * o0.x + cofactor_y * o0.y + cofactor_z * o0.z;
    vec3 n1 = cofactor_x * o1.x + cofactor_y * o1.y + cofactor_z * o1.z;
    vec3 n2 = cofactor_x * o2.x + cofactor_y * o2.y + cofactor_z * o2.z;
    n0 *= inversesqrt(max(dot(n0, n0), 1e-30));
    n1 *= inversesqrt(max(dot(n1, n1), 1e-30));
    n2 *= inversesqrt(max(dot(n2, n2), 1e-30));
    vec3 shading = n0 * b.x + n1 * b.y + n2 * b.z;
    float length2 = dot(shading, shading);
    g.N = length2 > 1e-20 ? shading * inversesqrt(length2) : g.Ng;
    // Hanika 2021, "Hacking the shadow terminator": the point moved onto the vertices' tangent planes.
    vec3 d0 = g.P - p0, d1 = g.P - p1, d2 = g.P - p2;
    g.terminator_offset = -(n0 * (min(dot(d0, n0), 0.0) * b.x) + n1 * (min(dot(d1, n1), 0.0) * b.y) + n2 * (min(dot(d2, n2), 0.0) * b.z));
  }
  g.uv = vec2(0.0);
  if (with_uv) {
    int uv = int(word_high(word_at(mesh, HW_MESH_WORD_DEFAULT_UV)));
    if (uv >= 0) g.uv = load_uv(mesh + uint64_t(8u * HW_MESH_WORD_ATTRIBUTES + uint(uv) * HW_ATTRIBUTE_BYTES), v, c, hit.primitive, b);
  }
  g.material = triangle_material(word_at(mesh, HW_MESH_WORD_TRI_SLOTS), instance.slot_offset, instance.slot_count, hit.primitive);
  g.object_index = instance.object_index;
  g.instance_flags = instance.flags;
  g.light_offset = instance.light_offset;
  g.terminator_cutoff = instance.shadow_terminator_offset;
  return g;
}

// Where the point was in the last frame: world space, by the instance's last transform and the mesh's last vertices.
vec3 previous_position(Hit hit) {
  InstanceTable instances = InstanceTable(HW_ROOT.instances);
  MeshTable meshes = MeshTable(HW_ROOT.meshes);
  uint mesh = instances.at[hit.instance].mesh;
  float m[12] = instances.at[hit.instance].previous_object_to_world;
  uint64_t motion = meshes.at[mesh].motion;
  Vec3Array positions = Vec3Array(motion != 0ul ? motion : meshes.at[mesh].positions);
  uvec3 v = load_triangle(meshes.at[mesh].tri_vertices, hit.primitive);
  vec3 p = positions.at[v.x] * (1.0 - hit.u - hit.v) + positions.at[v.y] * hit.u + positions.at[v.z] * hit.v;
  return HW_TRANSFORM_POINT(m, p);
}
#endif
