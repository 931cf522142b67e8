// SPDX-License-Identifier: Apache-2.0
// Pixel filters by importance sampling: a position is drawn from the filter, so that every sample weighs 1. Shapes and
// the meaning of the width are Cycles': Blackman-Harris covers width px to each side, the Gaussian has sigma = width /
// 4 cut at 1.5 widths, the box is one pixel whatever the width (Cycles ignores it too).
#ifndef HW_FILTER_H
#define HW_FILTER_H
#include "../shared/portable.h"
HW_NAMESPACE_BEGIN

HW_CONST uint HW_FILTER_BOX = 0u;
HW_CONST uint HW_FILTER_GAUSSIAN = 1u;
HW_CONST uint HW_FILTER_BLACKMAN_HARRIS = 2u;

// Inverse of the standard normal's cumulative distribution, to single precision for u in [1e-11, 1 - 1e-11]: Wichura
// 1988, algorithm AS 241, PPND7.
HW_FN float filter_normal_quantile(float u) {
  float q = u - 0.5f;
  float r = 0.180625f - q * q;
  float middle = q * (((59.109374720f * r + 159.29113202f) * r + 50.434271938f) * r + 3.3871327179f) /
                 (((67.187563600f * r + 78.757757664f) * r + 17.895169469f) * r + 1.0f);
  float p = max(min(u, 1.0f - u), 1e-11f);
  float t = sqrt(-log(p)) - 1.6f;
  float tail = (((0.17023821103f * t + 1.3067284816f) * t + 2.7568153900f) * t + 1.4234372777f) /
               ((0.12021132975f * t + 0.73700164250f) * t + 1.0f);
  return abs(q) <= 0.425f ? middle : (q < 0.0f ? -tail : tail);
}

// Blackman-Harris window on [-1, 1] (Harris 1978, four terms): x with cumulative distribution u, by Newton steps on the
// analytic integral from the quantile of a near normal distribution.
HW_FN float filter_blackman_harris(float u) {
  float x = clamp(0.25f * filter_normal_quantile(u), -0.98f, 0.98f);
  for (int i = 0; i < 3; ++i) {
    float a = HW_PI * x;
    float s = sin(a);
    float c = cos(a);
    float s2 = 2.0f * s * c;
    float c2 = 2.0f * c * c - 1.0f;
    float s3 = s2 * c + c2 * s;
    float c3 = c2 * c - s2 * s;
    float density = 0.35875f + 0.48829f * c + 0.14128f * c2 + 0.01168f * c3;
    float integral = 0.35875f * x + HW_INV_PI * (0.48829f * s + 0.07064f * s2 + 0.00389333f * s3);
    x = clamp(x - (integral - 0.35875f * (2.0f * u - 1.0f)) / max(density, 6e-5f), -1.0f, 1.0f);
  }
  return x;
}

// Offset from the pixel's centre in pixels for uniform u in [0, 1)^2.
HW_FN vec2 filter_sample(uint filter_type, float width, vec2 u) {
  // 0.9999999980 of the normal lies within six sigma: the cut needs no renormalisation.
  vec2 gaussian = vec2(filter_normal_quantile(u.x), filter_normal_quantile(u.y));
  vec2 box = u - vec2(0.5f);
  if (filter_type == HW_FILTER_BLACKMAN_HARRIS) {
    return vec2(filter_blackman_harris(u.x), filter_blackman_harris(u.y)) * width;
  }
  return filter_type == HW_FILTER_GAUSSIAN ? clamp(gaussian * 0.25f, vec2(-1.5f), vec2(1.5f)) * width : box;
}

HW_NAMESPACE_END
#endif
