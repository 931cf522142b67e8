// SPDX-License-Identifier: Apache-2.0
// Lights as the GPU sees them. One table holds lamps first, then the world (if it emits), then emissive triangles.
#ifndef HW_LIGHTS_SHARED_H
#define HW_LIGHTS_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_LIGHT_POINT = 0u;  // sphere of `radius` (0: a true point)
HW_CONST uint HW_LIGHT_SPOT = 1u;   // sphere of `radius` with a cone about -z of its axes
HW_CONST uint HW_LIGHT_SUN = 2u;   // disk of directions of half angle `angle`, towards +axis_z (where light comes from)
HW_CONST uint HW_LIGHT_AREA = 3u;  // rectangle or ellipse, emits along -axis_z
HW_CONST uint HW_LIGHT_WORLD = 4u;     // environment
HW_CONST uint HW_LIGHT_TRIANGLE = 5u;  // emissive triangle

HW_CONST uint HW_LIGHT_CAST_SHADOW = 1u;
HW_CONST uint HW_LIGHT_USE_MIS = 2u;   // BSDF rays may hit it and are weighted against next-event estimation
HW_CONST uint HW_LIGHT_ELLIPSE = 4u;   // area: ellipse instead of rectangle
HW_CONST uint HW_LIGHT_CAMERA = 8u;    // visible to camera rays
HW_CONST uint HW_LIGHT_DIFFUSE = 16u;  // ... to diffuse rays and surfaces
HW_CONST uint HW_LIGHT_GLOSSY = 32u;
HW_CONST uint HW_LIGHT_TRANSMISSION = 64u;
HW_CONST uint HW_LIGHT_SHADER = 128u;  // emission needs the material program (textured); `material` says which
HW_CONST uint HW_LIGHT_TWO_SIDED =
    256u;  // triangle: sampled from both faces (Cycles' default), else from axis_z's side
HW_CONST uint HW_LIGHT_SOFT_FALLOFF = 512u;  // point, spot: a disk that always faces the receiver instead of a sphere

// World space. `emission` is radiance [W m^-2 sr^-1] for anything with an area or solid angle, radiant intensity
// [W sr^-1] for a point of radius 0, irradiance [W m^-2] for a sun of angle 0.
struct LightRecord {
  uint type;
  uint flags;
  vec3 position;  // triangle: v0
  vec3 axis_x;    // unit; triangle: edge v1-v0 (not unit); spot: axes are the rows of the inverse of the lamp's 3x3
  vec3 axis_y;    // unit; triangle: edge v2-v0 (not unit)     matrix (not unit), so that a scaled spot has Cycles' cone
  vec3 axis_z;    // unit; triangle: normal of the side that is sampled, unit
  vec3 emission;
  float size_x;  // area: full width along axis_x; point, spot: radius; sun: half angle [rad]
  float size_y;  // area: full height along axis_y; sun: 1 - cos(size_x); spot: 1 - cos of the widest half cone angle
  float spread_or_spot;  // area: tan of half the spread; spot: cos of half the cone angle in the lamp's own space
  float spot_smooth;     // spot: 1 / ((1 - cos) blend); area: normalisation of the spread, 0 when it does not limit
  uint instance;         // triangle: instance index
  uint primitive;        // triangle: triangle index in its mesh; lamp: lamp index
  uint material;         // material index when HW_LIGHT_SHADER
  float area;            // triangle: world-space area
  uint emission_map;     // triangle: where its map begins in Root::emission_maps, 0: none (lib/emission_map.h)
};
HW_CONST uint HW_LIGHT_BYTES = 104u;
HW_CHECK_SIZE(LightRecord, HW_LIGHT_BYTES)

// What a Tracer needs to intersect a lamp (point/spot spheres with radius > 0, area lamps). Suns are at infinity:
// they are tested analytically on a miss. Rectangle and ellipse are hit from the side of -cross(axis_x, axis_y) only.
// A facing disk has its normal towards the ray's origin: centre, radius, normal = normalize(origin - center).
HW_CONST uint HW_LAMP_SHAPE_SPHERE = 0u;
HW_CONST uint HW_LAMP_SHAPE_RECTANGLE = 1u;
HW_CONST uint HW_LAMP_SHAPE_ELLIPSE = 2u;
HW_CONST uint HW_LAMP_SHAPE_NONE = 3u;         // keeps indices aligned
HW_CONST uint HW_LAMP_SHAPE_FACING_DISK = 4u;  // point and spot with soft falloff (Blender's default)
struct LampShape {
  uint shape;
  vec3 center;
  vec3 axis_x;  // times half the width for rectangle and ellipse
  vec3 axis_y;  // times half the height
  float radius;
};
HW_CHECK_SIZE(LampShape, 44)

struct AliasEntry {
  float threshold;  // take this entry when u < threshold, else `alias`
  uint alias;
  float pdf;  // probability of this entry
};
HW_CONST uint HW_ALIAS_BYTES = 12u;
HW_CHECK_SIZE(AliasEntry, HW_ALIAS_BYTES)

// Environment importance map: piecewise constant on a lat-long grid, rows weighted by sin(theta).
struct WorldDistribution {
  uint width;
  uint height;
  float total;  // 0: nothing to sample
  uint pad;
  uint64_t marginal;     // float[height + 1], CDF of rows
  uint64_t conditional;  // float[height * (width + 1)], CDF in each row
};
HW_CHECK_SIZE(WorldDistribution, 32)

HW_NAMESPACE_END
#endif
