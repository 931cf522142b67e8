// SPDX-License-Identifier: Apache-2.0
// Reads the scene's tables by address (shared/tables.h). Each accessor returns one record; nothing here writes.
#ifndef HW_TABLES_GLSL
#define HW_TABLES_GLSL
#include "../shared/features.h"
#include "../shared/path.h"
#include "../shared/rays.h"
#include "../shared/tables.h"
#include "push.glsl"
#include "root.glsl"
#include "words.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer MeshTable { MeshRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InstanceTable { InstanceRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MaterialTable { MaterialRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightTable { LightRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AliasTable { AliasEntry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec3Array { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vec4Array { vec4 at[]; };

// A light, by words (lib/words.glsl): the order is LightRecord's.
LightRecord light_load(uint index) {
  uint64_t w = HW_ROOT.lights + uint64_t(index) * HW_LIGHT_BYTES;
  uint64_t w0 = word_at(w, 0u), w8 = word_at(w, 8u), w9 = word_at(w, 9u), w10 = word_at(w, 10u), w11 = word_at(w, 11u), w12 = word_at(w, 12u);
  LightRecord r;
  r.type = word_low(w0);
  r.flags = word_high(w0);
  words_to_vectors(word_at(w, 1u), word_at(w, 2u), word_at(w, 3u), r.position, r.axis_x);
  words_to_vectors(word_at(w, 4u), word_at(w, 5u), word_at(w, 6u), r.axis_y, r.axis_z);
  r.emission = vec3(word_floats(word_at(w, 7u)), word_low_float(w8));
  r.size_x = word_high_float(w8);
  r.size_y = word_low_float(w9);
  r.spread_or_spot = word_high_float(w9);
  r.spot_smooth = word_low_float(w10);
  r.instance = word_high(w10);
  r.primitive = word_low(w11);
  r.material = word_high(w11);
  r.area = word_low_float(w12);
  r.emission_map = HW_HAS(HW_FEATURE_EMISSION_PROGRAM) ? word_high(w12) : 0u;
  return r;
}

// Rows of a row-major 3x4 matrix applied to points, vectors and normals. A macro, so that only the matrix is loaded.
#define HW_TRANSFORM_POINT(m, p)                                                       \
  vec3(m[0] * (p).x + m[1] * (p).y + m[2] * (p).z + m[3],                              \
       m[4] * (p).x + m[5] * (p).y + m[6] * (p).z + m[7],                              \
       m[8] * (p).x + m[9] * (p).y + m[10] * (p).z + m[11])
#define HW_TRANSFORM_VECTOR(m, v)                                                      \
  vec3(m[0] * (v).x + m[1] * (v).y + m[2] * (v).z,                                     \
       m[4] * (v).x + m[5] * (v).y + m[6] * (v).z,                                     \
       m[8] * (v).x + m[9] * (v).y + m[10] * (v).z)
// Transposed 3x3 part: with the inverse matrix this transforms a normal.
#define HW_TRANSFORM_TRANSPOSED(m, v)                                                  \
  vec3(m[0] * (v).x + m[4] * (v).y + m[8] * (v).z,                                     \
       m[1] * (v).x + m[5] * (v).y + m[9] * (v).z,                                     \
       m[2] * (v).x + m[6] * (v).y + m[10] * (v).z)

#endif
