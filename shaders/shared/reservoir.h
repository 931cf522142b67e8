// SPDX-License-Identifier: Apache-2.0
#ifndef HW_RESERVOIR_SHARED_H
#define HW_RESERVOIR_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN
struct Reservoir {
  uint light;        // index in the light table; HW_NONE: empty
  float u, v;        // where on the light (lib/light_point.h)
  float weight;      // W: unbiased contribution weight, in the light's normalised measure
  float confidence;  // M, c
  float target;      // p_hat at the surface that made it
};
HW_CHECK_SIZE(Reservoir, 24)
HW_NAMESPACE_END
#endif
