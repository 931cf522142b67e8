// SPDX-License-Identifier: Apache-2.0
// Which pixels of the last pass a surface may take reservoirs from: its own and those in a disk about it, as long as
// their surfaces are alike (Bitterli et al. 2020, section 5). Surfaces alone decide, never samples.
#ifndef HW_SCREEN_NEIGHBOURS_GLSL
#define HW_SCREEN_NEIGHBOURS_GLSL
#include "reuse.glsl"
#include "camera.h"
#include "geometry.glsl"

const float HW_SIMILAR_COSINE = 0.9063;  // 25 degrees
const float HW_SIMILAR_DEPTH = 0.1;

// Where the last pass saw a surface.
struct ScreenHome {
  uint pixel;  // HW_NONE: it did not
  float depth;
  bool primary;  // the path's first surface
};

bool screen_similar(ReuseSurface there, vec3 normal, float depth) {
  float d = camera_depth(HW_ROOT.camera, there.position);
  return there.key != HW_NONE && dot(octahedral_unpack(there.normal), normal) >= HW_SIMILAR_COSINE &&
         abs(d - depth) <= HW_SIMILAR_DEPTH * abs(depth);
}

// The pixel of the region that shows a raster position of the full frame; HW_NONE outside.
uint screen_pixel_at(vec2 raster01) {
  vec2 at = raster01 * vec2(HW_FRAME.width, HW_FRAME.height) - vec2(HW_FRAME.region_x, HW_FRAME.region_y);
  bool inside = at.x >= 0.0 && at.y >= 0.0 && at.x < float(HW_FRAME.region_width) && at.y < float(HW_FRAME.region_height);
  return inside ? uint(at.y) * HW_FRAME.region_width + uint(at.x) : HW_NONE;
}

ScreenHome screen_home(uint path, PathState state, vec3 position, bool primary) {
  CameraRecord camera = HW_ROOT.camera;
  ScreenHome home;
  home.pixel = state.pixel;
  home.primary = primary;
  vec3 before = position;
  bool known = reuse_has(HW_REUSE_HISTORY);
  if (!primary) {
    home.pixel = screen_pixel_at(camera_project(camera, position));
    known = known && (camera.type == HW_CAMERA_PANORAMIC || camera_depth(camera, position) > 0.0);
  } else if (reuse_has(HW_REUSE_NEW_FRAME)) {
    before = previous_position(hit_load(path));
    home.pixel = screen_pixel_at(camera_project_previous(camera, before));
  }
  if (!known) home.pixel = HW_NONE;
  home.depth = camera_depth(camera, before);
  return home;
}

// Neighbour i of a surface that has a home: 0 is the home itself, the others are drawn. False: none. Draws two numbers.
bool screen_neighbour(ScreenHome home, uint i, vec3 normal, uint key, inout uint draws, out uint pixel,
                      out ReuseSurface there) {
  int width = int(HW_FRAME.region_width), height = int(HW_FRAME.region_height);
  float angle = 2.0 * HW_PI * random_next(draws), r = HW_REUSE.radius * sqrt(random_next(draws));
  int x = int(home.pixel) % width + (i == 0u ? 0 : int(round(r * cos(angle))));
  int y = int(home.pixel) / width + (i == 0u ? 0 : int(round(r * sin(angle))));
  if (x < 0 || y < 0 || x >= width || y >= height) return false;
  pixel = uint(y) * uint(width) + uint(x);
  if (i > 0u && pixel == home.pixel) return false;
  there = reuse_surface_load(HW_REUSE.screen_surfaces, pixel);
  if (home.primary ? !screen_similar(there, normal, home.depth) : there.key == HW_NONE) return false;
  return !(home.primary && i == 0u && there.key != key);
}
#endif
