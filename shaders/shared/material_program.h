// SPDX-License-Identifier: Apache-2.0
// Material programs: a straight-line register machine of vec3 registers. This file is the format; it is read by the
// assembler (headwater/materials/opcodes.py mirrors it, a test compares the two), by the checker
// (core/materials/program_check.h) and by the interpreter (lib/material_vm.glsl).
//
// A program is an array of rows of four words. Row 0 is the header:
//   word 0  HW_PROGRAM_MAGIC
//   word 1  first row of the surface section    (closures, emission, transparency; runs when a path hits the surface)
//   word 2  first row of the emission section   (emission or background only; runs for light samples and misses)
//   word 3  first row of the transparency section (transparency only; runs for shadow rays)
// A section is 0 when it would do nothing. It runs row by row to HW_OP_END: there are no jumps, so every program ends.
//
// Other rows:
//   word 0  opcode (8 bits) | destination register (8) | `sub`, the opcode's variant (16)
//   word 1  operand a (16) | operand b (16)
//   word 2  operand c (16) | operand d (16)
//   word 3  immediate: an image, a table of constants, an attribute's hash, or operands e (16) | f (16)
// An operand is a register, or with HW_OPERAND_CONSTANT set an entry of the material's constants. A scalar is kept in
// all three components. Registers 0 to 3 hold inputs when a section starts (HW_REGISTER_*).
//
// Opcodes are ordered in tiers. The interpreter nests one loop per tier, dearer tiers outside, because an
// implementation that runs both sides of every branch (lavapipe before Mesa 24) then pays for the dear operations once
// per dear row instead of once per row.
//
// Images: an image immediate of a program as the assembler makes it indexes the material's own list of images
// (MaterialData::images). Upload replaces it by the index into Root::images with hw::patch_program_images
// (core/materials/program_check.h); nothing else in a program depends on the rest of the scene.
#ifndef HW_MATERIAL_PROGRAM_H
#define HW_MATERIAL_PROGRAM_H
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_PROGRAM_MAGIC = 0x48570001u;  // "HW", version 1
HW_CONST uint HW_VM_REGISTERS = 64u;
HW_CONST uint HW_VM_MAX_ROWS = 16384u;       // rows in one program
HW_CONST uint HW_VM_MAX_CONSTANTS = 32768u;  // constants of one material
HW_CONST uint HW_VM_MAX_CLOSURE_ROWS = 64u;  // closure rows in one section
HW_CONST uint HW_OPERAND_CONSTANT = 0x8000u;

HW_CONST uint HW_SECTION_SURFACE = 1u;  // word of the header
HW_CONST uint HW_SECTION_EMISSION = 2u;
HW_CONST uint HW_SECTION_TRANSPARENCY = 3u;

HW_CONST uint HW_REGISTER_UV = 0u;          // default UV map (u, v, 0); background: (0, 0, 0)
HW_CONST uint HW_REGISTER_POSITION = 1u;    // world; background: direction looked in
HW_CONST uint HW_REGISTER_NORMAL = 2u;      // shading normal, on the viewer's side
HW_CONST uint HW_REGISTER_INCOMING = 3u;    // towards the viewer, unit
HW_CONST uint HW_REGISTER_FIRST_FREE = 4u;  // programs write from here on

// Tiers: opcodes below the bound belong to the tier.
HW_CONST uint HW_TIER_CORE_END = 32u;
HW_CONST uint HW_TIER_NORMAL = 56u;  // from here on to the end of the look-ups: a loop of their own, of normals
HW_CONST uint HW_TIER_LOOKUP_END = 64u;
HW_CONST uint HW_TIER_PROCEDURAL_END = 96u;
HW_CONST uint HW_TIER_CLOSURE_END = 128u;

// X(name, code, operands read as bits a=1 b=2 c=4 d=8 e=16 f=32, features needed besides the core: HW_VM_*)
#define HW_MATERIAL_OPS(X)                                                                                             \
  X(HW_OP_END, 255u, 0u, 0u)                                                                                           \
  /* core: componentwise unless said otherwise */                                                                      \
  X(HW_OP_FMA, 1u, 7u, 0u) /* a * b + c */                                                                             \
  X(HW_OP_MIX, 2u, 7u, 0u) /* a + (b - a) * c */                                                                       \
  X(HW_OP_DIV, 3u, 3u, 0u) /* a / b, 0 where b is 0 */                                                                 \
  X(HW_OP_MIN, 4u, 3u, 0u)                                                                                             \
  X(HW_OP_MAX, 5u, 3u, 0u)                                                                                             \
  X(HW_OP_LESS, 6u, 3u, 0u) /* a < b ? 1 : 0 */                                                                        \
  X(HW_OP_FLOOR, 7u, 1u, 0u)                                                                                           \
  X(HW_OP_SQRT, 8u, 1u, 0u) /* 0 below 0 */                                                                            \
  X(HW_OP_DOT, 9u, 3u, 0u)  /* dot product, in all components */                                                       \
  X(HW_OP_CROSS, 10u, 3u, 0u)                                                                                          \
  X(HW_OP_NORMALIZE, 11u, 1u, 0u) /* 0 for the zero vector */                                                          \
  X(HW_OP_COMBINE, 12u, 7u, 0u)   /* (a[i], b[j], c[k]), sub = i | j << 2 | k << 4 */                                  \
  X(HW_OP_SELECT, 13u, 7u, 0u)    /* c != 0 ? b : a */                                                                 \
  /* look-ups and transcendental functions */                                                                          \
  X(HW_OP_MATH, 32u, 3u, HW_VM_MATH)       /* sub = HW_MATH_*; scalar: of a.x and b.x */                               \
  X(HW_OP_MATRIX, 33u, 1u, HW_VM_MATH)     /* constants imm .. imm+2 are rows (x, y, z, offset) */                     \
  X(HW_OP_TABLE, 34u, 1u, HW_VM_TABLE)     /* sub = entries - 1 | HW_TABLE_*; imm = first entry; component i */        \
                                           /* of the result from component i of the table at a[i] in 0..1 */           \
  X(HW_OP_INPUT, 35u, 1u, HW_VM_INPUT)     /* sub = HW_INPUT_* | shift << 8; a filter width of the shift */            \
  X(HW_OP_ATTRIBUTE, 36u, 1u, HW_VM_INPUT) /* imm = hash; sub = HW_ATTRIBUTE_* | shift << 8; a as for INPUT */         \
  X(HW_OP_TRANSFORM, 37u, 1u, HW_VM_INPUT) /* sub = from | to << 2 | HW_TRANSFORM_* << 4 */                            \
  X(HW_OP_IMAGE, 38u, 3u, HW_VM_IMAGE) /* a coordinates, b object-space normal (box only); imm image; sub see below; d \
                                          names a second destination for alpha, 0 for none */                          \
  X(HW_OP_ENVIRONMENT, 39u, 1u,                                                                                        \
    HW_VM_IMAGE)                       /* a direction to texture coordinates; sub 0 equirectangular, 1 mirror ball */  \
  X(HW_OP_COLOR, 40u, 1u, HW_VM_COLOR) /* sub = HW_COLOR_* conversions */                                              \
  X(HW_OP_BUMP, 56u, 7u,                                                                                               \
    HW_VM_NORMAL) /* a (height, height at dx, at dy), b (strength, distance, filter width), c normal */                \
  X(HW_OP_NORMAL_MAP, 57u, 7u,                                                                                         \
    HW_VM_NORMAL) /* a colour, b strength, c normal; sub = HW_NORMAL_MAP_*; imm = hash of tangents */                  \
  X(HW_OP_FRESNEL, 43u, 3u, HW_VM_MATH) /* a index of refraction, b normal; facing ratio of b if sub is 1 */           \
  /* procedural */                                                                                                     \
  X(HW_OP_NOISE, 64u, 15u,                                                                                             \
    HW_VM_NOISE) /* a coordinates, b (w, detail, roughness), c (lacunarity, distortion, offset), d gain */             \
  X(HW_OP_VORONOI, 65u, 15u, HW_VM_VORONOI)    /* a coordinates, b (w, detail, roughness), c (lacunarity, smoothness,  \
                                                  exponent), d (randomness, -, -) */                                   \
  X(HW_OP_WHITE_NOISE, 66u, 3u, HW_VM_PATTERN) /* a coordinates, b w; sub = dimensions | colour << 4 */                \
  X(HW_OP_MAGIC, 67u, 7u, HW_VM_PATTERN)       /* a coordinates, b distortion, c scale; sub = depth */                 \
  X(HW_OP_BRICK, 68u, 15u,                                                                                             \
    HW_VM_PATTERN) /* a coordinates, b (mortar, smooth, bias), c (width, height, offset), d (squash, -, -); sub =      \
                      offset frequency | squash frequency << 8; result (tint, mortar, 0) */                            \
  /* closures; operand e is the closure's weight (scalar): the product of its Mix Shader factors */                    \
  X(HW_OP_EMISSION, 96u, 1u, 0u)              /* a radiance, weight included (surface or background) */                \
  X(HW_OP_TRANSPARENT, 97u, 1u, 0u)           /* a colour, weight included */                                          \
  X(HW_OP_HOLDOUT, 98u, 1u, 0u)               /* a weight */                                                           \
  X(HW_OP_DIFFUSE, 99u, 23u, 0u)              /* a colour, b roughness, c normal */                                    \
  X(HW_OP_TRANSLUCENT, 100u, 21u, HW_VM_BSDF) /* a colour, c normal */                                                 \
  X(HW_OP_GLOSSY, 101u, 31u, HW_VM_BSDF)      /* a colour, b (roughness, anisotropy, rotation in turns), c normal, d   \
                                                 tangent; sub = HW_DISTRIBUTION_* */                                   \
  X(HW_OP_GLASS, 102u, 23u, HW_VM_BSDF)       /* a colour, b (roughness, ior, 0), c normal; sub = HW_DISTRIBUTION_* */ \
  X(HW_OP_REFRACTION, 103u, 23u, HW_VM_BSDF)  /* a colour, b (roughness, ior, 0), c normal */                          \
  X(HW_OP_SHEEN, 104u, 23u, HW_VM_BSDF)       /* a colour, b roughness, c normal */                                    \
  X(HW_OP_TOON, 105u, 23u, HW_VM_BSDF)        /* a colour, b (size, smooth, 0), c normal; sub 1: glossy */             \
  X(HW_OP_METALLIC, 106u, 63u,                                                                                         \
    HW_VM_BSDF) /* a base colour or n, b (roughness, anisotropy, rotation in turns), c normal, d tangent, f edge tint  \
                   or k; sub = HW_DISTRIBUTION_* | HW_METALLIC_* */                                                    \
  X(HW_OP_PRINCIPLED, 107u, 63u, HW_VM_PRINCIPLED) /* three rows, see below */                                         \
  X(HW_OP_ARGUMENTS, 108u, 63u,                                                                                        \
    0u) /* six more operands of the closure row before it: a .. f, f where word 3's top half is */

#define HW_OP_CONSTANT_(name, code, operands, features) HW_CONST uint name = code;
HW_MATERIAL_OPS(HW_OP_CONSTANT_)
#undef HW_OP_CONSTANT_

// Families of operations a program uses; a kernel without a family leaves its code out (shared/features.h: bits
// HW_FEATURE_VM_SHIFT and up of the specialisation constant HW_FEATURES).
HW_CONST uint HW_VM_MATH = 1u;
HW_CONST uint HW_VM_TABLE = 2u;
HW_CONST uint HW_VM_INPUT = 4u;
HW_CONST uint HW_VM_IMAGE = 8u;
HW_CONST uint HW_VM_COLOR = 16u;
HW_CONST uint HW_VM_NORMAL = 32u;
HW_CONST uint HW_VM_NOISE = 64u;
HW_CONST uint HW_VM_VORONOI = 128u;
HW_CONST uint HW_VM_PATTERN = 256u;
HW_CONST uint HW_VM_BSDF = 512u;  // closures of single-BSDF nodes other than Diffuse
HW_CONST uint HW_VM_PRINCIPLED = 1024u;

HW_CONST uint HW_TABLE_ENTRIES = 0xFFFu;
HW_CONST uint HW_TABLE_STEP = 0x8000u;         // no blending between entries
HW_CONST uint HW_TABLE_EXTRAPOLATE = 0x4000u;  // straight on outside 0..1
HW_CONST uint HW_TABLE_ALPHA = 0x2000u;        // fourth component, in all three

HW_CONST uint HW_MATH_POW = 0u;  // as Cycles' Power: 0 where undefined, x^0 = 1
HW_CONST uint HW_MATH_LOG = 1u;  // of a to base b, 0 where undefined
HW_CONST uint HW_MATH_EXP = 2u;
HW_CONST uint HW_MATH_SIN = 3u;
HW_CONST uint HW_MATH_COS = 4u;
HW_CONST uint HW_MATH_TAN = 5u;
HW_CONST uint HW_MATH_ASIN = 6u;  // argument clamped to [-1, 1]
HW_CONST uint HW_MATH_ACOS = 7u;
HW_CONST uint HW_MATH_ATAN2 = 8u;  // atan(a, b)
HW_CONST uint HW_MATH_SINH = 9u;
HW_CONST uint HW_MATH_COSH = 10u;
HW_CONST uint HW_MATH_TANH = 11u;

// What HW_OP_INPUT reads. `shift` 1 and 2 give the value at the point moved along either tangent by the pixel's
// footprint times operand a, for bump mapping; inputs that do not depend on the point ignore it.
HW_CONST uint HW_INPUT_UV = 0u;
HW_CONST uint HW_INPUT_POSITION = 1u;
HW_CONST uint HW_INPUT_NORMAL = 2u;
HW_CONST uint HW_INPUT_TRUE_NORMAL = 3u;  // geometric, on the viewer's side
HW_CONST uint HW_INPUT_PARAMETRIC = 4u;   // barycentrics
HW_CONST uint HW_INPUT_GENERATED = 5u;
HW_CONST uint HW_INPUT_OBJECT = 6u;  // object-space position
HW_CONST uint HW_INPUT_CAMERA = 7u;  // camera-space position, Blender's axes: z is depth
HW_CONST uint HW_INPUT_WINDOW = 8u;  // 0..1 over the frame
HW_CONST uint HW_INPUT_REFLECTION = 9u;
HW_CONST uint HW_INPUT_OBJECT_NORMAL = 10u;  // shading normal in object space
HW_CONST uint HW_INPUT_OBJECT_LOCATION = 11u;
HW_CONST uint HW_INPUT_OBJECT_COLOR = 12u;
HW_CONST uint HW_INPUT_OBJECT_DATA = 13u;    // (object index, random, material index)
HW_CONST uint HW_INPUT_CAMERA_VECTOR = 14u;  // from the camera to the point, camera space, unit
HW_CONST uint HW_INPUT_CAMERA_DEPTH = 15u;   // (z depth, distance, 0)
HW_CONST uint HW_INPUT_IS_CAMERA_SHADOW_DIFFUSE = 16u;
HW_CONST uint HW_INPUT_IS_GLOSSY_SINGULAR_REFLECTION = 17u;
HW_CONST uint HW_INPUT_IS_TRANSMISSION_VOLUME_BACKFACING = 18u;
HW_CONST uint HW_INPUT_RAY_LENGTH_DEPTH_DIFFUSE = 19u;
HW_CONST uint HW_INPUT_DEPTH_GLOSSY_TRANSPARENT_TRANSMISSION = 20u;
HW_CONST uint HW_INPUT_TANGENT = 21u;   // default UV map's, world, unit, 0 without one
HW_CONST uint HW_INPUT_RADIAL_X = 22u;  // radial tangents about the object's axes, world
HW_CONST uint HW_INPUT_RADIAL_Y = 23u;
HW_CONST uint HW_INPUT_RADIAL_Z = 24u;
HW_CONST uint HW_INPUT_COUNT = 25u;

HW_CONST uint HW_ATTRIBUTE_VALUE = 0u;    // xyz, missing components 0 (a scalar is kept in all three)
HW_CONST uint HW_ATTRIBUTE_ALPHA = 1u;    // fourth component, 1 if there is none
HW_CONST uint HW_ATTRIBUTE_TANGENT = 2u;  // a tangent attribute: world space, normalised
HW_CONST uint HW_ATTRIBUTE_EXISTS = 3u;   // 1 or 0

HW_CONST uint HW_SPACE_WORLD = 0u;
HW_CONST uint HW_SPACE_OBJECT = 1u;
HW_CONST uint HW_SPACE_CAMERA = 2u;
HW_CONST uint HW_TRANSFORM_AS_VECTOR = 0u;
HW_CONST uint HW_TRANSFORM_AS_POINT = 1u;
HW_CONST uint HW_TRANSFORM_AS_NORMAL = 2u;

// sub of HW_OP_IMAGE: interpolation | extension << 2 | projection << 4 | HW_IMAGE_UNPREMULTIPLY | box blend << 8 (in
// 1/255). RGB is decoded from sRGB after filtering, as Cycles does.
HW_CONST uint HW_INTERPOLATION_LINEAR = 0u;
HW_CONST uint HW_INTERPOLATION_CLOSEST = 1u;
HW_CONST uint HW_INTERPOLATION_CUBIC = 2u;
HW_CONST uint HW_EXTENSION_REPEAT = 0u;
HW_CONST uint HW_EXTENSION_EXTEND = 1u;
HW_CONST uint HW_EXTENSION_CLIP = 2u;
HW_CONST uint HW_EXTENSION_MIRROR = 3u;
HW_CONST uint HW_PROJECTION_FLAT = 0u;
HW_CONST uint HW_PROJECTION_BOX = 1u;
HW_CONST uint HW_IMAGE_UNPREMULTIPLY = 64u;  // divide RGB by alpha where the image is premultiplied

HW_CONST uint HW_COLOR_RGB_TO_HSV = 0u;
HW_CONST uint HW_COLOR_HSV_TO_RGB = 1u;
HW_CONST uint HW_COLOR_RGB_TO_HSL = 2u;
HW_CONST uint HW_COLOR_HSL_TO_RGB = 3u;

HW_CONST uint HW_NORMAL_MAP_TANGENT = 0u;
HW_CONST uint HW_NORMAL_MAP_OBJECT = 1u;
HW_CONST uint HW_NORMAL_MAP_WORLD = 2u;

// sub of HW_OP_NOISE: type | dimensions << 4 | normalise << 8 | colour << 9.
HW_CONST uint HW_NOISE_FBM = 0u;
HW_CONST uint HW_NOISE_MULTIFRACTAL = 1u;
HW_CONST uint HW_NOISE_RIDGED = 2u;
HW_CONST uint HW_NOISE_HYBRID = 3u;
HW_CONST uint HW_NOISE_HETERO_TERRAIN = 4u;

// sub of HW_OP_VORONOI: feature | metric << 3 | dimensions << 6 | normalise << 9 | output << 10.
HW_CONST uint HW_VORONOI_F1 = 0u;
HW_CONST uint HW_VORONOI_F2 = 1u;
HW_CONST uint HW_VORONOI_SMOOTH_F1 = 2u;
HW_CONST uint HW_VORONOI_DISTANCE_TO_EDGE = 3u;
HW_CONST uint HW_VORONOI_N_SPHERE_RADIUS = 4u;
HW_CONST uint HW_METRIC_EUCLIDEAN = 0u;
HW_CONST uint HW_METRIC_MANHATTAN = 1u;
HW_CONST uint HW_METRIC_CHEBYCHEV = 2u;
HW_CONST uint HW_METRIC_MINKOWSKI = 3u;
HW_CONST uint HW_VORONOI_OUT_DISTANCE = 0u;
HW_CONST uint HW_VORONOI_OUT_COLOR = 1u;
HW_CONST uint HW_VORONOI_OUT_POSITION = 2u;
HW_CONST uint HW_VORONOI_OUT_W = 3u;

HW_CONST uint HW_DISTRIBUTION_GGX = 0u;
HW_CONST uint HW_DISTRIBUTION_MULTI_GGX = 1u;
HW_CONST uint HW_DISTRIBUTION_BECKMANN = 2u;
HW_CONST uint HW_DISTRIBUTION_ASHIKHMIN_SHIRLEY = 3u;
HW_CONST uint HW_METALLIC_F82 = 0u;
HW_CONST uint HW_METALLIC_CONDUCTOR = 4u;  // physical conductor; or-ed with the distribution

// HW_OP_PRINCIPLED, sub: bit 0 multiscatter GGX.
//   a base colour, b (metallic, roughness, ior), c normal, d (alpha, diffuse roughness, subsurface weight), e weight,
//   f (specular level, anisotropy, rotation in turns)
// then two HW_OP_ARGUMENTS rows:
//   a specular tint, b tangent, c (transmission, film thickness nm, film ior), d (coat weight, coat roughness, coat
//   ior), e coat tint, f coat normal a (sheen weight, sheen roughness, emission strength), b sheen tint, c emission
//   colour, d to f unused

HW_NAMESPACE_END
#endif
