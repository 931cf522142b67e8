// SPDX-License-Identifier: Apache-2.0
// Toon shading: a disk of light of half angle `size` with a linear border `smooth`, about the normal (diffuse) or the
// mirror direction (glossy). As Cycles has it: the lobe is 1 / (its cone's solid angle), without a cosine.
#ifndef HW_TOON_H
#define HW_TOON_H
#include "frame.h"
HW_NAMESPACE_BEGIN

HW_FN float toon_cone(float size, float border) { return min(size + border, 0.5f * HW_PI); }
HW_FN float toon_cone_height(float cone) { return 2.0f * square(sin(0.5f * cone)); }

// cos_axis: cosine between the axis and the direction.
HW_FN float toon_intensity(float size, float border, float cos_axis) {
  float angle = acos(clamp(cos_axis, -1.0f, 1.0f));
  return angle < size ? 1.0f : saturate(1.0f - (angle - size) / max(border, 1e-6f));
}

// Uniform in the cone: the pdf. 0 outside.
HW_FN float toon_pdf(float size, float border, float cos_axis) {
  float cone = toon_cone(size, border);
  float height = toon_cone_height(cone);
  return 1.0f - cos_axis < height ? 1.0f / (2.0f * HW_PI * height) : 0.0f;
}

HW_NAMESPACE_END
#endif
