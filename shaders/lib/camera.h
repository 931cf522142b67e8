// SPDX-License-Identifier: Apache-2.0
// Camera rays and projections, with Cycles' conventions for depth of field, clipping and the passes that follow.
#ifndef HW_CAMERA_H
#define HW_CAMERA_H
#include "../shared/tables.h"
#include "panorama.h"
#include "warp.h"
HW_NAMESPACE_BEGIN

HW_FN vec3 camera_row_transform(vec3 x, vec3 y, vec3 z, vec3 v) { return vec3(dot(x, v), dot(y, v), dot(z, v)); }
HW_FN vec3 camera_to_world_direction(CameraRecord c, vec3 v) {
  return camera_row_transform(vec3(c.camera_to_world[0], c.camera_to_world[1], c.camera_to_world[2]),
                              vec3(c.camera_to_world[4], c.camera_to_world[5], c.camera_to_world[6]),
                              vec3(c.camera_to_world[8], c.camera_to_world[9], c.camera_to_world[10]), v);
}
HW_FN vec4 camera_panorama_range(CameraRecord c) {
  return vec4(c.panorama_range[0], c.panorama_range[1], c.panorama_range[2], c.panorama_range[3]);
}
HW_FN vec4 camera_panorama_lens(CameraRecord c) {
  return vec4(c.panorama_lens[0], c.panorama_lens[1], c.panorama_lens[2], c.panorama_lens[3]);
}
HW_FN vec3 camera_position(CameraRecord c) {
  return vec3(c.camera_to_world[3], c.camera_to_world[7], c.camera_to_world[11]);
}

// Point of the aperture of radius 1: a disk, or a regular polygon with its corners on the circle, turned by
// aperture_rotation; the anamorphic ratio narrows x.
HW_FN vec2 camera_aperture(CameraRecord c, vec2 u) {
  float blades = max(float(c.aperture_blades), 3.0f);
  float scaled = u.x * blades;
  float blade = min(floor(scaled), blades - 1.0f);
  float s = sqrt(clamp(scaled - blade, 0.0f, 1.0f));
  float t = u.y * s;
  float half_angle = HW_PI / blades;
  // A triangle from the centre to one side, which faces along x.
  vec2 p = vec2(s * cos(half_angle), (2.0f * t - s) * sin(half_angle));
  float turn = c.aperture_rotation + blade * 2.0f * half_angle;
  vec2 polygon = vec2(cos(turn) * p.x - sin(turn) * p.y, sin(turn) * p.x + cos(turn) * p.y);
  vec2 lens = c.aperture_blades < 3u ? warp_disk(u) : polygon;
  return vec2(lens.x / max(c.aperture_ratio, 1e-6f), lens.y);
}

// The ray of a picture position. raster01: (0, 0) bottom left to (1, 1) top right of the full frame. lens_u: uniform.
// World space; direction is of unit length, [tmin, tmax] lies between the clip planes across the viewing direction
// (spheres for panoramas). With depth of field the planes hold for the centre of the aperture only, as in Cycles; a
// panorama's focus is a sphere. The direction is zero where a panorama shows nothing.
HW_FN void camera_ray(CameraRecord c, vec2 raster01, vec2 lens_u, HW_OUT(vec3) origin, HW_OUT(vec3) direction,
                      HW_OUT(float) tmin, HW_OUT(float) tmax) {
  vec2 plane = vec2(mix(c.left, c.right, raster01.x), mix(c.bottom, c.top, raster01.y));
  bool orthographic = c.type == HW_CAMERA_ORTHOGRAPHIC;
  bool panoramic = c.type == HW_CAMERA_PANORAMIC;
  vec2 lens = c.aperture_radius > 0.0f ? camera_aperture(c, lens_u) * c.aperture_radius : vec2(0.0f);
  // Camera space, looking along -z. Rays of one picture point meet on the plane of focus.
  vec3 start = orthographic ? vec3(plane + lens, 0.0f) : vec3(lens, 0.0f);
  vec3 focus = orthographic ? vec3(plane, -c.focus_distance) : vec3(plane, -1.0f) * c.focus_distance;
  vec3 towards = orthographic ? vec3(0.0f, 0.0f, -1.0f) : vec3(plane, -1.0f);
  towards = c.aperture_radius > 0.0f ? focus - start : towards;
  if (panoramic) {
    towards = panorama_to_direction(c.panorama, camera_panorama_range(c), camera_panorama_lens(c), plane);
    start = vec3(0.0f);
    if (c.aperture_radius > 0.0f && dot(towards, towards) > 0.0f) {  // the aperture faces where the ray goes
      vec3 v = vec3(0.0f, 0.0f, -1.0f) + towards * towards.z;
      v = dot(v, v) > 1e-12f ? normalize(v) : vec3(1.0f, 0.0f, 0.0f);
      start = v * lens.x + cross(towards, v) * lens.y;
      towards = towards * c.focus_distance - start;
    }
  }
  vec3 d = dot(towards, towards) > 0.0f ? normalize(towards) : vec3(0.0f);
  // Ray length per depth: the pinhole ray's for every point of the aperture; orthographic rays keep the depth's length.
  float per_depth = panoramic ? 1.0f : (orthographic ? 1.0f / max(-d.z, 1e-6f) : sqrt(1.0f + dot(plane, plane)));
  origin = camera_to_world_direction(c, start) + camera_position(c);
  vec3 world = camera_to_world_direction(c, d);
  direction = dot(world, world) > 0.0f ? normalize(world) : vec3(0.0f);
  tmin = c.clip_start * per_depth;
  tmax = tmin + (c.clip_end - c.clip_start) * (orthographic ? 1.0f : per_depth);
}

// Depth pass of a world point: distance along the viewing direction; for panoramas distance from the camera.
HW_FN float camera_depth(CameraRecord c, vec3 P) {
  vec3 d = P - camera_position(c);
  float along = -dot(vec3(c.camera_to_world[2], c.camera_to_world[6], c.camera_to_world[10]), d);
  return c.type == HW_CAMERA_PANORAMIC ? length(d) : along;
}
HW_CONST float HW_DEPTH_MISS = 1e10f;  // Cycles' depth where nothing was hit

// Mist pass of a world point, 0..1; 1 where nothing was hit. By distance from the camera (orthographic: along the
// viewing direction). falloff: 2 quadratic, 1 linear, 0.5 inverse quadratic, as Blender's world settings.
HW_FN float camera_mist(CameraRecord c, vec3 P, float start, float depth, float falloff) {
  float d = c.type == HW_CAMERA_ORTHOGRAPHIC ? camera_depth(c, P) : length(P - camera_position(c));
  float f = clamp((d - start) / max(depth, 1e-6f), 0.0f, 1.0f);
  return f > 0.0f ? pow(f, falloff) : 0.0f;
}

// Projection of a camera-space point (looking along -z) to raster01.
HW_FN vec2 camera_project_local(CameraRecord c, vec4 plane, vec3 p) {
  float depth = c.type == HW_CAMERA_PERSPECTIVE ? max(-p.z, 1e-9f) : 1.0f;
  vec2 at = vec2(p.x, p.y) * (1.0f / depth);
  if (c.type == HW_CAMERA_PANORAMIC)
    at = panorama_from_direction(c.panorama, camera_panorama_range(c), camera_panorama_lens(c), p);
  return vec2((at.x - plane.x) / (plane.y - plane.x), (at.y - plane.z) / (plane.w - plane.z));
}

// How wide the frame is per metre of distance; orthographic: in metres.
HW_FN float camera_width(CameraRecord c) {
  float across = c.right - c.left;
  if (c.type != HW_CAMERA_PANORAMIC) return across;
  return across * panorama_width(c.panorama, camera_panorama_range(c), camera_panorama_lens(c));
}

// Raster position of a world point in this frame. camera_to_world must be rigid (as the scene makes it).
HW_FN vec2 camera_project(CameraRecord c, vec3 P) {
  vec3 d = P - camera_position(c);
  vec3 x = vec3(c.camera_to_world[0], c.camera_to_world[4], c.camera_to_world[8]);
  vec3 y = vec3(c.camera_to_world[1], c.camera_to_world[5], c.camera_to_world[9]);
  vec3 z = vec3(c.camera_to_world[2], c.camera_to_world[6], c.camera_to_world[10]);
  return camera_project_local(c, vec4(c.left, c.right, c.bottom, c.top), camera_row_transform(x, y, z, d));
}

// Raster position of a world point in the previous frame.
HW_FN vec2 camera_project_previous(CameraRecord c, vec3 P) {
  vec3 p = camera_row_transform(
      vec3(c.previous_world_to_camera[0], c.previous_world_to_camera[1], c.previous_world_to_camera[2]),
      vec3(c.previous_world_to_camera[4], c.previous_world_to_camera[5], c.previous_world_to_camera[6]),
      vec3(c.previous_world_to_camera[8], c.previous_world_to_camera[9], c.previous_world_to_camera[10]), P);
  p = p + vec3(c.previous_world_to_camera[3], c.previous_world_to_camera[7], c.previous_world_to_camera[11]);
  return camera_project_local(c, vec4(c.previous_left, c.previous_right, c.previous_bottom, c.previous_top), p);
}

HW_NAMESPACE_END
#endif
