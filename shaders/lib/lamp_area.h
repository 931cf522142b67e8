// SPDX-License-Identifier: Apache-2.0
// Area lamps: rectangle or ellipse, one-sided (along -axis_z), with Cycles' spread. Rectangles are sampled by solid
// angle (Urena, Fajardo and King 2013), ellipses by area; a small spread narrows what is sampled to what can light P.
#ifndef HW_LAMP_AREA_H
#define HW_LAMP_AREA_H
#include "light_sample.h"
HW_NAMESPACE_BEGIN

// The part of the lamp's plane that is sampled for a receiver: a rectangle or an ellipse with the lamp's axes.
struct AreaDomain {
  vec2 center;  // in the lamp's plane, from its centre along axis_x, axis_y [m]
  vec2 size;    // full size [m]; 0: nothing to sample (or a spread of 0)
  bool ellipse;
  bool empty;
};

// Cycles' spread: the share of light that passes a grid of slats, by the tangent of the angle to the lamp's normal,
// normalised so that the lamp's power stays. `cosine` is the cosine of that angle at the lamp, > 0.
HW_FN float lamp_area_spread(LightRecord light, float cosine) {
  if (!HW_LIT_BY(HW_KIND_SPREAD)) return 1.0f;
  float tangent = sqrt(max(0.0f, 1.0f - cosine * cosine)) / max(cosine, 1e-6f);
  float f = max((light.spread_or_spot - tangent) * light.spot_smooth, 0.0f);
  f = light.spread_or_spot > 0.0f ? f : (cosine > 0.9999997f ? HW_PI : 0.0f);
  return light.spot_smooth > 0.0f ? f : 1.0f;
}

HW_FN bool lamp_area_is_ellipse(LightRecord light) {
  return HW_LIT_BY(HW_KIND_ELLIPSE) && (light.flags & HW_LIGHT_ELLIPSE) != 0u;
}

// Whether its spread limits where it shines.
HW_FN bool lamp_area_limited(LightRecord light) { return HW_LIT_BY(HW_KIND_SPREAD) && light.spot_smooth > 0.0f; }

// `local`: P seen from the lamp's centre along axis_x, axis_y and distance in front of the plane.
HW_FN AreaDomain lamp_area_domain(LightRecord light, vec3 local) {
  AreaDomain a;
  vec2 full = vec2(light.size_x, light.size_y);
  bool ellipse = lamp_area_is_ellipse(light);
  bool limited = lamp_area_limited(light);
  // Everything that lights P lies in a disk of radius `reach` about P's foot on the plane.
  float reach = limited ? min(local.z * light.spread_or_spot, 1e18f) : 1e18f;
  vec2 foot = vec2(local.x, local.y);
  vec2 lo = max(foot - vec2(reach), full * -0.5f);
  vec2 hi = min(foot + vec2(reach), full * 0.5f);
  vec2 box = hi - lo;
  float box_area = max(box.x, 0.0f) * max(box.y, 0.0f);
  float lamp_area = 0.25f * HW_PI * full.x * full.y;
  float disk_area = HW_PI * reach * reach;
  // An ellipse is sampled through whichever covers the lit part with the least area.
  bool use_box = !ellipse || (limited && box_area < min(lamp_area, disk_area));
  bool use_disk = !use_box && limited && disk_area < lamp_area;
  a.center = use_box ? (lo + hi) * 0.5f : (use_disk ? foot : vec2(0.0f));
  a.size = use_box ? box : (use_disk ? vec2(2.0f * reach) : full);
  a.ellipse = !use_box;
  a.empty = local.z <= 0.0f || ((box.x <= 0.0f || box.y <= 0.0f) && reach > 0.0f);
  return a;
}

// Solid angle of the rectangle [x0, x1] x [y0, y1] at height h > 0 from the origin. Sum of four right-angled corners,
// each an arc tangent, so that small rectangles keep their relative precision.
HW_FN float lamp_rectangle_solid_angle(float x0, float x1, float y0, float y1, float h) {
  float r00 = sqrt(x0 * x0 + y0 * y0 + h * h);
  float r10 = sqrt(x1 * x1 + y0 * y0 + h * h);
  float r01 = sqrt(x0 * x0 + y1 * y1 + h * h);
  float r11 = sqrt(x1 * x1 + y1 * y1 + h * h);
  return atan(x1 * y1, h * r11) - atan(x0 * y1, h * r01) - atan(x1 * y0, h * r10) + atan(x0 * y0, h * r00);
}

// Below this many steradians the rectangle is sampled by area: single precision no longer resolves its solid angle,
// and the two differ by nothing that matters.
HW_CONST float HW_RECTANGLE_SOLID_ANGLE_MIN = 0.02f;

// A point of the rectangle, uniform in solid angle: Urena et al. 2013, with the lamp's plane at -h.
HW_FN vec2 lamp_rectangle_warp(float x0, float x1, float y0, float y1, float h, float solid_angle, vec2 u) {
  float n0 = -y0 * inversesqrt(h * h + y0 * y0);
  float n2 = y1 * inversesqrt(h * h + y1 * y1);
  float n3 = -x0 * inversesqrt(h * h + x0 * x0);
  // Angles between the planes through neighbouring edges; k as in the paper. By the arc tangent: GLSL's acos may be
  // poor (absolute error 1e-4 on some devices), and a shift of k moves the samples.
  float c2 = clamp(-n2 * n3, -1.0f, 1.0f);
  float c3 = clamp(-n3 * n0, -1.0f, 1.0f);
  float g2 = atan(sqrt(max(0.0f, 1.0f - c2 * c2)), c2);
  float g3 = atan(sqrt(max(0.0f, 1.0f - c3 * c3)), c3);
  float k = 2.0f * HW_PI - g2 - g3;
  float au = u.x * solid_angle + k;
  float sine = sin(au);
  float fu = (cos(au) * n0 - n2) / (abs(sine) < 1e-9f ? 1e-9f : sine);
  float cu = clamp((fu > 0.0f ? 1.0f : -1.0f) * inversesqrt(fu * fu + n0 * n0), -1.0f, 1.0f);
  float xu = clamp(cu * h * inversesqrt(max(1.0f - cu * cu, 1e-14f)), x0, x1);
  float d2 = xu * xu + h * h;
  float h0 = y0 * inversesqrt(d2 + y0 * y0);
  float h1 = y1 * inversesqrt(d2 + y1 * y1);
  float hv = h0 + u.y * (h1 - h0);
  float hv2 = hv * hv;
  float yv = hv2 < 1.0f - 1e-6f ? hv * sqrt(d2) * inversesqrt(1.0f - hv2) : y1;
  return vec2(xu, clamp(yv, y0, y1));
}

// Solid angle of the domain where it is sampled by solid angle, 0 where it is sampled by area.
HW_FN float lamp_area_domain_angle(AreaDomain a, vec3 local) {
  vec2 lo = a.center - a.size * 0.5f - vec2(local.x, local.y);
  vec2 hi = a.center + a.size * 0.5f - vec2(local.x, local.y);
  float solid_angle = lamp_rectangle_solid_angle(lo.x, hi.x, lo.y, hi.y, local.z);
  return !a.ellipse && solid_angle > HW_RECTANGLE_SOLID_ANGLE_MIN ? solid_angle : 0.0f;
}

// Solid-angle pdf of sampling the domain, for a point at distance t under the cosine at the lamp.
HW_FN float lamp_area_domain_pdf(AreaDomain a, float solid_angle, float t, float cosine) {
  float area = a.size.x * a.size.y * (a.ellipse ? 0.25f * HW_PI : 1.0f);
  return solid_angle > 0.0f ? 1.0f / solid_angle : t * t / max(cosine * area, 1e-36f);
}

HW_FN vec3 lamp_area_local(LightRecord light, vec3 P) {
  vec3 d = P - light.position;
  return vec3(dot(d, light.axis_x), dot(d, light.axis_y), -dot(d, light.axis_z));
}

// Samples an area lamp from P. False: P is behind the lamp, or the sample fell off the lamp or outside the spread.
HW_FN bool lamp_area_sample(LightRecord light, vec3 P, vec2 u, HW_OUT(LightSample) s) {
  s = light_sample_none();
  vec3 local = lamp_area_local(light, P);
  AreaDomain a = lamp_area_domain(light, local);
  if (a.empty) {
    return false;
  }
  bool delta = lamp_area_limited(light) && light.spread_or_spot <= 0.0f;
  float solid_angle = lamp_area_domain_angle(a, local);
  vec2 lo = a.center - a.size * 0.5f - vec2(local.x, local.y);
  vec2 hi = a.center + a.size * 0.5f - vec2(local.x, local.y);
  vec2 by_angle = lamp_rectangle_warp(lo.x, hi.x, lo.y, hi.y, local.z, max(solid_angle, 1e-3f), u);
  vec2 in_square = a.ellipse ? warp_disk(u) : u * 2.0f - vec2(1.0f);
  vec2 by_area = a.center + in_square * a.size * 0.5f - vec2(local.x, local.y);
  vec2 offset = solid_angle > 0.0f ? by_angle : by_area;  // from P's foot on the plane
  offset = delta ? vec2(0.0f) : offset;
  float t2 = dot(offset, offset) + local.z * local.z;
  float t = sqrt(t2);
  float cosine = local.z / t;
  s.wi = (light.axis_x * offset.x + light.axis_y * offset.y + light.axis_z * local.z) * (1.0f / t);
  s.distance = t;
  s.pdf = delta ? 1.0f : lamp_area_domain_pdf(a, solid_angle, t, cosine);
  s.radiance = light.emission * lamp_area_spread(light, cosine);
  s.normal = -light.axis_z;
  s.uv = vec2((offset.x + local.x) / light.size_x, (offset.y + local.y) / light.size_y) + vec2(0.5f);
  s.flags = delta ? HW_LIGHT_SAMPLE_DELTA : 0u;
  vec2 e = s.uv - vec2(0.5f);
  bool ellipse = lamp_area_is_ellipse(light);
  bool on_lamp = ellipse ? dot(e, e) <= 0.250001f : max(abs(e.x), abs(e.y)) <= 0.500001f;
  return on_lamp && s.radiance.x + s.radiance.y + s.radiance.z > 0.0f;
}

// Solid-angle pdf with which lamp_area_sample makes the direction wi, which hits the lamp at distance t.
HW_FN float lamp_area_pdf(LightRecord light, vec3 P, vec3 wi, float t) {
  vec3 local = lamp_area_local(light, P);
  AreaDomain a = lamp_area_domain(light, local);
  float cosine = dot(wi, light.axis_z);
  vec2 at = (vec2(local.x, local.y) + vec2(dot(wi, light.axis_x), dot(wi, light.axis_y)) * t - a.center) /
            max(a.size, vec2(1e-30f));
  bool inside = a.ellipse ? dot(at, at) <= 0.25001f : max(abs(at.x), abs(at.y)) <= 0.50001f;
  bool delta = lamp_area_limited(light) && light.spread_or_spot <= 0.0f;
  float pdf = lamp_area_domain_pdf(a, lamp_area_domain_angle(a, local), t, max(cosine, 1e-8f));
  return a.empty || delta || cosine <= 0.0f || !inside ? 0.0f : pdf;
}

HW_NAMESPACE_END
#endif
