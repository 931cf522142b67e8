// SPDX-License-Identifier: Apache-2.0
// Latitude-longitude mapping of directions, with Cycles' convention: u = 0.5 looks along +x, u falls with the
// azimuth, v = 0 is straight down (-z) and v = 1 straight up; rows of an image count upwards from v = 0.
#ifndef HW_EQUIRECT_H
#define HW_EQUIRECT_H
#include "../shared/portable.h"
HW_NAMESPACE_BEGIN

// Unit direction to uv in [0, 1]^2. The poles have u = 0.5.
HW_FN vec2 equirect_from_direction(vec3 d) {
  float horizontal = sqrt(d.x * d.x + d.y * d.y);
  float phi = horizontal > 0.0f ? atan(d.y, d.x) : 0.0f;
  return vec2(0.5f - phi * (0.5f * HW_INV_PI), 0.5f + atan(d.z, horizontal) * HW_INV_PI);
}

// uv (u is periodic) to a unit direction.
HW_FN vec3 equirect_to_direction(vec2 uv) {
  float phi = HW_PI * (1.0f - 2.0f * uv.x);
  float latitude = HW_PI * (uv.y - 0.5f);
  float c = cos(latitude);
  return vec3(c * cos(phi), c * sin(phi), sin(latitude));
}

HW_NAMESPACE_END
#endif
