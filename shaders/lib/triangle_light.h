// SPDX-License-Identifier: Apache-2.0
// Emissive triangles: uniform in solid angle when they fill a good part of the view (Arvo 1995), else uniform in area.
// Where the emission varies over the triangle, by its map (lib/emission_map.h) in place of the area; in a good part of
// the view both, as a mixture.
#ifndef HW_TRIANGLE_LIGHT_H
#define HW_TRIANGLE_LIGHT_H
#include "emission_map.h"
#include "light_sample.h"
HW_NAMESPACE_BEGIN

// Solid angle of a triangle given by one corner and two edges relative to the viewer: van Oosterom and Strackee 1983,
// with the volume from the edges so that small triangles keep their precision.
HW_FN float triangle_solid_angle(vec3 a, vec3 edge1, vec3 edge2) {
  vec3 b = a + edge1;
  vec3 c = a + edge2;
  float la = length(a);
  float lb = length(b);
  float lc = length(c);
  float volume = abs(dot(a, cross(edge1, edge2)));
  float below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  return 2.0f * atan(volume, below);
}

// Smaller triangles are sampled by area: the spherical map loses precision and gains nothing.
HW_CONST float HW_TRIANGLE_SOLID_ANGLE_MIN = 0.01f;

// Barycentrics uniform in area: Heitz 2019, "A Low-Distortion Map Between Triangle and Square".
HW_FN vec2 triangle_warp_area(vec2 u) {
  float s = min(u.x, u.y) * 0.5f;
  return u.y > u.x ? vec2(s, u.y - s) : vec2(u.x - s, s);
}

// The inverse of triangle_warp_area.
HW_FN vec2 triangle_unwarp_area(vec2 uv) {
  return uv.y > uv.x ? vec2(uv.x * 2.0f, uv.x + uv.y) : vec2(uv.x + uv.y, uv.y * 2.0f);
}

HW_FN bool triangle_has_map(LightRecord light) { return HW_LIT_BY(HW_KIND_TRIANGLE_MAP) && light.emission_map != 0u; }

// The share of points drawn uniformly in solid angle; the others are drawn by area or by the map. A map knows nothing
// of distance, the solid angle nothing of what is bright: the more of the view a triangle with a map fills, the more of
// it is left to the solid angle, up to a half.
HW_FN float triangle_angle_share(LightRecord light, float solid_angle) {
  float share = !triangle_has_map(light) ? 1.0f : 0.5f * min(solid_angle, 1.0f);
  return solid_angle > HW_TRIANGLE_SOLID_ANGLE_MIN ? share : 0.0f;
}

// Solid-angle pdf of a point at the square of a distance, seen at a cosine to the normal. `density`: of its place by
// the map, relative to the area's; 1 without one.
HW_FN float triangle_point_pdf(LightRecord light, float solid_angle, float density, float cosine, float distance2) {
  float share = triangle_angle_share(light, solid_angle);
  float by_angle = share > 0.0f ? share / solid_angle : 0.0f;
  float by_area = share < 1.0f ? (1.0f - share) * density * distance2 / max(cosine * light.area, 1e-36f) : 0.0f;
  return by_angle + by_area;
}

// Unit direction uniform in the solid angle of the triangle with unit directions A, B, C to its corners: Arvo 1995,
// "Stratified Sampling of Spherical Triangles".
HW_FN vec3 triangle_warp_sphere(vec3 A, vec3 B, vec3 C, float solid_angle, vec2 u) {
  vec3 nab = cross(A, B);
  vec3 nca = cross(C, A);
  float cos_c = dot(A, B);
  // Interior angle at A between the planes AB and AC.
  float cos_alpha = -dot(nab, nca) * inversesqrt(max(dot(nab, nab) * dot(nca, nca), 1e-36f));
  cos_alpha = clamp(cos_alpha, -1.0f, 1.0f);
  float sin_alpha = sqrt(max(0.0f, 1.0f - cos_alpha * cos_alpha));
  float area = u.x * solid_angle;
  float sa = sin(area);
  float ca = cos(area);
  float s = sa * cos_alpha - ca * sin_alpha;  // sin(area - alpha)
  float t = ca * cos_alpha + sa * sin_alpha;  // cos(area - alpha)
  float k1 = t - cos_alpha;
  float k2 = s + sin_alpha * cos_c;
  float above = (k2 * t - k1 * s) * cos_alpha - k2;
  float below = (k2 * s + k1 * t) * sin_alpha;
  // At area 0 the cut is the corner C itself only in the limit; it is 0/0 there.
  float q = abs(below) > 1e-12f ? clamp(above / below, -1.0f, 1.0f) : 1.0f;
  vec3 in_plane = C - A * dot(C, A);
  in_plane = in_plane * inversesqrt(max(dot(in_plane, in_plane), 1e-36f));
  vec3 cut = A * q + in_plane * sqrt(max(0.0f, 1.0f - q * q));
  float z = 1.0f - u.y * (1.0f - dot(cut, B));
  vec3 side = cut - B * dot(cut, B);
  side = side * inversesqrt(max(dot(side, side), 1e-36f));
  return B * z + side * sqrt(max(0.0f, 1.0f - z * z));
}

// Samples an emissive triangle from P. `maps`: Root::emission_maps. False: P is on a side that is not sampled, in its
// plane, or it is degenerate.
HW_FN bool triangle_light_sample(LightRecord light, uint64_t maps, vec3 P, vec2 u, HW_OUT(LightSample) s) {
  s = light_sample_none();
  vec3 a = light.position - P;
  float height = -dot(a, light.axis_z);  // of P over the plane, on the side of the normal
  bool two_sided = (light.flags & HW_LIGHT_TWO_SIDED) != 0u;
  if (!(light.area > 0.0f) || height == 0.0f || (height < 0.0f && !two_sided)) {
    return false;
  }
  vec3 b = a + light.axis_x;
  vec3 c = a + light.axis_y;
  float solid_angle = triangle_solid_angle(a, light.axis_x, light.axis_y);
  float share = triangle_angle_share(light, solid_angle);
  bool by_angle = u.x < share;
  u.x = by_angle ? u.x / share : min((u.x - share) / max(1.0f - share, 1e-6f), 0.99999994f);
  vec3 wi = triangle_warp_sphere(normalize(a), normalize(b), normalize(c), solid_angle, u);
  // Where that direction meets the plane, as barycentrics (Moller and Trumbore 1997 with the origin at P).
  vec3 p = cross(wi, light.axis_y);
  float det = dot(light.axis_x, p);
  float inv_det = det != 0.0f ? 1.0f / det : 0.0f;
  vec3 q = cross(-a, light.axis_x);
  vec2 hit = vec2(dot(-a, p), dot(wi, q)) * inv_det;
  hit = clamp(hit, vec2(0.0f), vec2(1.0f));
  hit = hit * (1.0f / max(hit.x + hit.y, 1.0f));
  float density = 1.0f;
  if (triangle_has_map(light)) {
    if (by_angle) {
      density = emission_map_density(maps, light.emission_map, triangle_unwarp_area(hit));
    } else {
      u = emission_map_sample(maps, light.emission_map, u, density);
    }
  }
  s.uv = by_angle ? hit : triangle_warp_area(u);
  vec3 d = a + light.axis_x * s.uv.x + light.axis_y * s.uv.y;
  float t2 = dot(d, d);
  float t = sqrt(t2);
  s.wi = d * (1.0f / max(t, 1e-30f));
  s.distance = t;
  float cosine = abs(height) / max(t, 1e-30f);
  s.pdf = triangle_point_pdf(light, solid_angle, density, cosine, t2);
  s.radiance = light.emission;
  s.normal = height < 0.0f ? -light.axis_z : light.axis_z;
  return t2 > 0.0f && cosine > 0.0f;
}

// Solid-angle pdf with which triangle_light_sample makes the direction wi, which hits the triangle at distance t in the
// point with barycentrics uv.
HW_FN float triangle_light_pdf(LightRecord light, uint64_t maps, vec3 P, vec3 wi, float t, vec2 uv) {
  vec3 a = light.position - P;
  float height = -dot(a, light.axis_z);
  bool two_sided = (light.flags & HW_LIGHT_TWO_SIDED) != 0u;
  bool sampled = light.area > 0.0f && height != 0.0f && (height > 0.0f || two_sided);
  float solid_angle = triangle_solid_angle(a, light.axis_x, light.axis_y);
  float density = 1.0f;
  if (triangle_has_map(light)) {
    density = emission_map_density(maps, light.emission_map, triangle_unwarp_area(uv));
  }
  float pdf = triangle_point_pdf(light, solid_angle, density, abs(dot(wi, light.axis_z)), t * t);
  return sampled ? pdf : 0.0f;
}

HW_NAMESPACE_END
#endif
