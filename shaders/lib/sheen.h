// SPDX-License-Identifier: Apache-2.0
// Microfibre sheen as a linearly transformed cosine: Zeltner, Burley and Chiang 2022, "Practical multiple-scattering
// sheen using linearly transformed cosines". The transform maps w to (a x + b z, a y, z) in the frame whose x is the
// viewer's side; a, b and the albedo come from the table (lib/luts.h).
#ifndef HW_SHEEN_H
#define HW_SHEEN_H
#include "frame.h"
HW_NAMESPACE_BEGIN

// Density over the upper hemisphere; it is both f·cos / albedo and the pdf. With w' = M w and |det M| = a^2 the density
// is cos(w') / pi · a^2 / |w'|^3, where cos(w') = z / |w'|.
HW_FN float sheen_density(float a, float b, vec3 N, vec3 wo, vec3 wi) {
  vec3 x, y;
  frame_from_tangent(N, wo, x, y);
  float z = dot(N, wi);
  float length2 = square(a * dot(x, wi) + b * z) + square(a * dot(y, wi)) + z * z;
  return HW_INV_PI * max(z, 0.0f) * square(a / max(length2, 1e-20f));
}

HW_FN vec3 sheen_sample(float a, float b, vec3 N, vec3 wo, vec2 u) {
  vec3 x, y;
  frame_from_tangent(N, wo, x, y);
  vec3 d = square_to_cosine_hemisphere(u);
  // The inverse transform, scaled by a.
  vec3 w = normalize(vec3(d.x - d.z * b, d.y, d.z * a));
  return w.x * x + w.y * y + w.z * N;
}

HW_NAMESPACE_END
#endif
