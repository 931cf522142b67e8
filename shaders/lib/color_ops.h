// SPDX-License-Identifier: Apache-2.0
// Conversions between RGB, HSV and HSL (A. R. Smith 1978, "Color gamut transform pairs"; hue in 0..1), and the sRGB
// transfer function (IEC 61966-2-1).
#ifndef HW_COLOR_OPS_H
#define HW_COLOR_OPS_H
#include "../shared/material_program.h"
HW_NAMESPACE_BEGIN

HW_FN float srgb_to_linear(float x) {
  float low = max(x, 0.0f) * (1.0f / 12.92f);
  float high = pow(max((x + 0.055f) * (1.0f / 1.055f), 0.0f), 2.4f);
  return x < 0.04045f ? low : high;
}

// Hue of a colour in 0..1; `top` is the largest component, `delta` > 0 its distance from the smallest.
HW_FN float hue_of(vec3 c, float top, float delta) {
  float h = c.x == top ? (c.y - c.z) / delta : (c.y == top ? 2.0f + (c.z - c.x) / delta : 4.0f + (c.x - c.y) / delta);
  h = h * (1.0f / 6.0f);
  return h < 0.0f ? h + 1.0f : h;
}

// Fully saturated colour of a hue: distance from each primary on the hexagon.
HW_FN vec3 hue_to_rgb(float h) {
  float h6 = h * 6.0f;
  return clamp(vec3(abs(h6 - 3.0f) - 1.0f, 2.0f - abs(h6 - 2.0f), 2.0f - abs(h6 - 4.0f)), vec3(0.0f), vec3(1.0f));
}

// HW_OP_COLOR; `conversion` is HW_COLOR_*.
HW_FN vec3 color_convert(uint conversion, vec3 c) {
  if (conversion == HW_COLOR_HSV_TO_RGB) {
    // Outside 0..1 the hexagon's last sector goes on, as in Blender.
    vec3 pure = hue_to_rgb(c.x);
    vec3 rgb = (vec3(1.0f) - (vec3(1.0f) - pure) * c.y) * c.z;
    float f = c.x * 6.0f - floor(c.x * 6.0f);
    vec3 last = vec3(c.z, c.z * (1.0f - c.y), c.z * (1.0f - c.y * f));
    return c.x < 0.0f || c.x > 1.0f ? (c.y == 0.0f ? vec3(c.z) : last) : rgb;
  }
  if (conversion == HW_COLOR_HSL_TO_RGB) {
    float chroma = (1.0f - abs(2.0f * c.z - 1.0f)) * c.y;
    return (hue_to_rgb(c.x) - vec3(0.5f)) * chroma + vec3(c.z);
  }
  float top = max(c.x, max(c.y, c.z));
  float bottom = min(c.x, min(c.y, c.z));
  float delta = top - bottom;
  float hue = delta > 0.0f ? hue_of(c, top, delta) : 0.0f;
  float lightness = min(1.0f, 0.5f * (top + bottom));
  float hsl_range = lightness > 0.5f ? 2.0f - top - bottom : top + bottom;
  float hsv_s = top != 0.0f ? delta / top : 0.0f;
  float hsl_s = delta > 0.0f && hsl_range != 0.0f ? delta / hsl_range : 0.0f;
  return conversion == HW_COLOR_RGB_TO_HSV ? vec3(hsv_s != 0.0f ? hue : 0.0f, hsv_s, top) : vec3(hue, hsl_s, lightness);
}

HW_NAMESPACE_END
#endif
