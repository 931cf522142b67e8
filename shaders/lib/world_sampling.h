// SPDX-License-Identifier: Apache-2.0
// Importance sampling of the environment from WorldDistribution (shared/lights.h): rows by their cumulative
// distribution, then columns; inside a cell uniform in solid angle, so the pdf is constant in a cell and finite at the
// poles.
#ifndef HW_WORLD_SAMPLING_H
#define HW_WORLD_SAMPLING_H
#include "../shared/lights.h"
#include "cumulative.h"
#include "equirect.h"
HW_NAMESPACE_BEGIN

// Solid angle of a cell in row y.
HW_FN float world_cell_solid_angle(WorldDistribution w, uint y) {
  float step_v = HW_PI / float(w.height);
  // sin(b) - sin(a) for latitudes a, b = -pi/2 + y step, without cancellation.
  float middle = step_v * (float(y) + 0.5f);
  return 2.0f * HW_PI / float(w.width) * 2.0f * sin(middle) * sin(0.5f * step_v);
}

// Draws a direction `wi` (unit, away from the scene) with solid-angle pdf `pdf`. pdf 0: there is nothing to sample.
HW_FN void world_sample(WorldDistribution w, vec2 u, HW_OUT(vec3) wi, HW_OUT(float) pdf) {
  wi = vec3(0.0f, 0.0f, 1.0f);
  pdf = 0.0f;
  if (!(w.total > 0.0f)) {
    return;
  }
  uint y = cumulative_find(w.marginal, 0u, w.height, u.y);
  float m0 = HW_CUMULATIVE(w.marginal, y);
  float row = HW_CUMULATIVE(w.marginal, y + 1u) - m0;
  uint first = y * (w.width + 1u);
  uint x = cumulative_find(w.conditional, first, w.width, u.x);
  float c0 = HW_CUMULATIVE(w.conditional, first + x);
  float column = HW_CUMULATIVE(w.conditional, first + x + 1u) - c0;
  if (!(row > 0.0f && column > 0.0f)) {
    return;
  }
  float fx = clamp((u.x - c0) / column, 0.0f, 0.99999994f);
  float fy = clamp((u.y - m0) / row, 0.0f, 0.99999994f);
  float phi = HW_PI * (1.0f - 2.0f * (float(x) + fx) / float(w.width));
  // Uniform in z between the row's edges: z = -cos(colatitude from below).
  float a = HW_PI * float(y) / float(w.height);
  float b = HW_PI * float(y + 1u) / float(w.height);
  float z = -mix(cos(a), cos(b), fy);
  float r = sqrt(max(0.0f, 1.0f - z * z));
  wi = vec3(r * cos(phi), r * sin(phi), z);
  pdf = row * column / world_cell_solid_angle(w, y);
}

// Solid-angle pdf with which world_sample makes the unit direction wi.
HW_FN float world_pdf(WorldDistribution w, vec3 wi) {
  if (!(w.total > 0.0f)) {
    return 0.0f;
  }
  vec2 uv = equirect_from_direction(wi);
  uint x = uint(clamp(int(uv.x * float(w.width)), 0, int(w.width) - 1));
  uint y = uint(clamp(int(uv.y * float(w.height)), 0, int(w.height) - 1));
  uint first = y * (w.width + 1u) + x;
  float row = HW_CUMULATIVE(w.marginal, y + 1u) - HW_CUMULATIVE(w.marginal, y);
  float column = HW_CUMULATIVE(w.conditional, first + 1u) - HW_CUMULATIVE(w.conditional, first);
  return row * column / world_cell_solid_angle(w, y);
}

HW_NAMESPACE_END
#endif
