// SPDX-License-Identifier: Apache-2.0
// The scene as the GPU sees it: one root struct with the address of every table. Written by core/scene, read by stages.
#ifndef HW_TABLES_H
#define HW_TABLES_H
#include "light_tree.h"
#include "lights.h"
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_MAX_ATTRIBUTES = 8u;

// A mesh's attribute: `components` floats an element.
HW_CONST uint HW_DOMAIN_VERTEX = 0u;  // indexed by tri_vertices
HW_CONST uint HW_DOMAIN_CORNER = 1u;  // indexed by tri_corners
HW_CONST uint HW_DOMAIN_FACE = 2u;    // indexed by triangle
struct Attribute {
  uint64_t data;  // float[count * components]
  uint name;      // hash of the attribute's name (hw::attribute_hash), 0 = unused entry
  uint domain;
  uint components;  // 1 to 4
  uint pad;
};
HW_CONST uint HW_ATTRIBUTE_BYTES = 24u;
HW_CHECK_SIZE(Attribute, HW_ATTRIBUTE_BYTES)

HW_CONST uint HW_CORNERS_IN_ORDER = 1u;  // in place of an address

struct MeshRecord {
  uint64_t positions;     // vec3[vertices], object space
  uint64_t tri_vertices;  // uint[3 * triangles]
  uint64_t tri_corners;   // uint[3 * triangles]; 0: same as tri_vertices; HW_CORNERS_IN_ORDER: 0, 1, 2, ...
  uint64_t normals;       // vec3[corners]; 0: flat shaded
  uint64_t tri_slots;     // uint8 per triangle: material slot; 0: all slot 0
  uint64_t motion;        // vec3[vertices]: last frame's positions; 0: did not deform
  uint vertex_count;
  uint triangle_count;
  uint attribute_count;
  int default_uv;  // index of the active render UV map among attributes, -1 if none
  Attribute attributes[8];
};
HW_CONST uint HW_MESH_BYTES = 256u;
HW_CHECK_SIZE(MeshRecord, HW_MESH_BYTES)
// Where surface_geometry (lib/geometry.glsl) finds members: index of the 64-bit word.
HW_CONST uint HW_MESH_WORD_POSITIONS = 0u;
HW_CONST uint HW_MESH_WORD_TRI_VERTICES = 1u;
HW_CONST uint HW_MESH_WORD_TRI_CORNERS = 2u;
HW_CONST uint HW_MESH_WORD_NORMALS = 3u;
HW_CONST uint HW_MESH_WORD_TRI_SLOTS = 4u;
HW_CONST uint HW_MESH_WORD_DEFAULT_UV = 7u;  // attribute_count, default_uv
HW_CONST uint HW_MESH_WORD_ATTRIBUTES = 8u;
HW_CHECK_OFFSET(MeshRecord, positions, 8 * HW_MESH_WORD_POSITIONS)
HW_CHECK_OFFSET(MeshRecord, tri_vertices, 8 * HW_MESH_WORD_TRI_VERTICES)
HW_CHECK_OFFSET(MeshRecord, tri_corners, 8 * HW_MESH_WORD_TRI_CORNERS)
HW_CHECK_OFFSET(MeshRecord, normals, 8 * HW_MESH_WORD_NORMALS)
HW_CHECK_OFFSET(MeshRecord, tri_slots, 8 * HW_MESH_WORD_TRI_SLOTS)
HW_CHECK_OFFSET(MeshRecord, default_uv, 8 * HW_MESH_WORD_DEFAULT_UV + 4)
HW_CHECK_OFFSET(MeshRecord, attributes, 8 * HW_MESH_WORD_ATTRIBUTES)

struct InstanceRecord {
  float object_to_world[12];  // row-major 3x4
  float world_to_object[12];
  float previous_object_to_world[12];
  uint mesh;
  uint slot_offset;  // into Root::slot_materials
  uint slot_count;
  uint mask;
  uint light_offset;               // first triangle light of this instance, HW_NONE when it has none
  uint object_index;               // pass index
  uint random_id;                  // for Object Info > Random: hash, 32 bits
  uint flags;                      // HW_INSTANCE_*
  vec3 color;                      // object colour
  float shadow_terminator_offset;  // Cycles' geometry offset, 0..1
  vec3 generated_min;              // texture space of the mesh for Generated coordinates: min and 1/size
  vec3 generated_scale;
  uint key;  // which object this is (hw::object_key): the same wherever its record lies in the table, never HW_NONE
  uint pad;
};
HW_CONST uint HW_INSTANCE_BYTES = 224u;
HW_CHECK_SIZE(InstanceRecord, HW_INSTANCE_BYTES)
// Where instance_load (lib/geometry.glsl) finds members: index of the 64-bit word. The matrix is the first six.
HW_CONST uint HW_INSTANCE_WORD_MESH = 18u;        // mesh, slot_offset; then slot_count, mask
HW_CONST uint HW_INSTANCE_WORD_LIGHT = 20u;       // light_offset, object_index
HW_CONST uint HW_INSTANCE_WORD_FLAGS = 21u;       // random_id, flags
HW_CONST uint HW_INSTANCE_WORD_TERMINATOR = 23u;  // color.z, shadow_terminator_offset
HW_CHECK_OFFSET(InstanceRecord, mesh, 8 * HW_INSTANCE_WORD_MESH)
HW_CHECK_OFFSET(InstanceRecord, light_offset, 8 * HW_INSTANCE_WORD_LIGHT)
HW_CHECK_OFFSET(InstanceRecord, flags, 8 * HW_INSTANCE_WORD_FLAGS + 4)
HW_CHECK_OFFSET(InstanceRecord, shadow_terminator_offset, 8 * HW_INSTANCE_WORD_TERMINATOR + 4)
HW_CONST uint HW_INSTANCE_MIRRORED = 1u;  // negative determinant
HW_CONST uint HW_INSTANCE_HOLDOUT = 2u;
HW_CONST uint HW_INSTANCE_SHADOW_CATCHER = 4u;
// The shading class of the instance's object (core/scene/shading_classes.h), set by the tables: flags >> this, one bit.
HW_CONST uint HW_INSTANCE_CLASS_SHIFT = 8u;
HW_CONST uint HW_MAX_SHADING_CLASSES = 2u;

struct MaterialRecord {
  uint program;  // first word in Root::programs
  uint program_words;
  uint constants;  // first vec4 in Root::constants
  uint flags;      // HW_MATERIAL_*
  vec3 emission;   // constant emission (radiance), when not HW_MATERIAL_EMISSION_SHADER
  uint pass_index;
};
HW_CONST uint HW_MATERIAL_BYTES = 32u;
HW_CHECK_SIZE(MaterialRecord, HW_MATERIAL_BYTES)
HW_CONST uint HW_MATERIAL_EMISSIVE = 1u;         // may emit: its triangles are lights
HW_CONST uint HW_MATERIAL_EMISSION_SHADER = 2u;  // emission varies: evaluate the program at the light point
HW_CONST uint HW_MATERIAL_TRANSPARENT = 4u;      // may let light straight through: shadow rays must ask the program
HW_CONST uint HW_MATERIAL_NO_MIS = 8u;           // emission sampling off: found by BSDF rays only
HW_CONST uint HW_MATERIAL_EMIT_FRONT = 16u;      // emission sampling "front" / "back" only
HW_CONST uint HW_MATERIAL_EMIT_BACK = 32u;
HW_CONST uint HW_MATERIAL_BUMP_CORRECTION = 64u;  // softened bump terminator: sets HW_SHADE_BUMP_CORRECTION
HW_CONST uint HW_MATERIAL_UNEVEN = 128u;          // its look depends on where it is seen from: the core sets it

HW_CONST uint HW_TEXEL_RGBA8 = 0u;
HW_CONST uint HW_TEXEL_RGBA16F = 1u;
HW_CONST uint HW_TEXEL_RGBA32F = 2u;
HW_CONST uint HW_TEXEL_R8 = 3u;
struct ImageRecord {
  uint64_t texels;  // row 0 at the bottom (v = 0), as Blender stores them
  uint width;       // 0: image missing, reads as magenta (1, 0, 1, 1)
  uint height;
  uint format;  // HW_TEXEL_*
  uint flags;   // HW_IMAGE_*
};
HW_CONST uint HW_IMAGE_BYTES = 24u;
HW_CHECK_SIZE(ImageRecord, HW_IMAGE_BYTES)
HW_CONST uint HW_IMAGE_SRGB = 1u;           // decode sRGB to linear after fetch of each texel
HW_CONST uint HW_IMAGE_PREMULTIPLIED = 2u;  // RGB already multiplied by alpha

HW_CONST uint HW_CAMERA_PERSPECTIVE = 0u;
HW_CONST uint HW_CAMERA_ORTHOGRAPHIC = 1u;
HW_CONST uint HW_CAMERA_PANORAMIC = 2u;              // lib/panorama.h
HW_CONST uint HW_PANORAMA_EQUIRECTANGULAR = 0u;      // range: longitude from, to, latitude from, to [rad]
HW_CONST uint HW_PANORAMA_FISHEYE_EQUIDISTANT = 1u;  // range: field of view [rad]
HW_CONST uint HW_PANORAMA_FISHEYE_EQUISOLID = 2u;    // range: focal length, field of view [rad], sensor's width, height
HW_CONST uint HW_PANORAMA_MIRROR_BALL = 3u;
HW_CONST uint HW_PANORAMA_CUBE_FACE = 4u;           // equal angles
HW_CONST uint HW_PANORAMA_CYLINDRICAL = 5u;         // range: longitude from, to [rad], height from, to over the radius
HW_CONST uint HW_PANORAMA_FISHEYE_POLYNOMIAL = 6u;  // range: field of view [rad], constant term, sensor's width, height
HW_CONST uint HW_PANORAMA_KINDS = 7u;
// The picture plane is described in camera space (x right, y up, looking along -z) by the rectangle that the full
// frame covers: at distance 1 for perspective, in metres for orthographic, as a part of the whole panorama (0 to 1) for
// panoramic. Shift and sensor fit are already in it.
struct CameraRecord {
  float camera_to_world[12];
  float previous_world_to_camera[12];
  float left, right, bottom, top;
  float previous_left, previous_right, previous_bottom, previous_top;
  uint type;
  float clip_start, clip_end;  // along the viewing direction (planes), metres
  float aperture_radius;       // 0: pinhole
  float focus_distance;
  uint aperture_blades;  // < 3: round
  float aperture_rotation;
  float aperture_ratio;  // Cycles' anamorphic ratio, 1 = round
  uint panorama;         // HW_PANORAMA_*
  float panorama_range[4];
  float panorama_lens[4];  // of HW_PANORAMA_FISHEYE_POLYNOMIAL: coefficients of the distance on the sensor, to the
                           // fourth power
  uint pad;
};
HW_CHECK_SIZE(CameraRecord, 200)

struct Root {
  uint64_t meshes;          // MeshRecord[]
  uint64_t instances;       // InstanceRecord[]
  uint64_t slot_materials;  // uint[]: material index of each instance slot
  uint64_t materials;       // MaterialRecord[]; entry 0 is the default grey
  uint64_t programs;        // uint[]
  uint64_t constants;       // vec4[]
  uint64_t images;          // ImageRecord[]
  uint64_t lights;          // LightRecord[]
  uint64_t light_alias;     // AliasEntry[light_count]
  uint64_t light_tree;      // LightTreeNode[light_tree_nodes], shared/light_tree.h
  uint64_t light_leaves;    // LightTreeBounds[]: of the light at each position
  uint64_t light_order;     // uint[]: the light at each position in the tree's leaf order
  uint64_t light_position;  // uint[lights]: the position of each light, HW_NONE: never chosen
  uint64_t emission_maps;   // float[]: lib/emission_map.h; none begins at 0
  uint64_t luts;            // float[]: albedo tables, see lib/luts.h
  WorldDistribution world;
  CameraRecord camera;
  LightTreeScale light_tree_scale;
  uint mesh_count, instance_count, material_count, image_count;
  uint light_count, lamp_count;
  uint world_light;     // index of the world among lights, HW_NONE if it does not emit
  uint world_material;  // material index whose program gives the background, HW_NONE: constant colour
  vec3 world_color;     // constant background radiance when world_material is HW_NONE
  uint sun_offset;      // suns are lamps [sun_offset, sun_offset + sun_count): tested on a miss
  uint sun_count;
  uint world_flags;       // HW_LIGHT_CAMERA etc.: which rays see the world
  uint light_tree_nodes;  // 0: there is no tree
  uint window;            // lower half of the address that the memory window begins at (core/gpu/memory_window.cpp)
};

HW_NAMESPACE_END
#endif
