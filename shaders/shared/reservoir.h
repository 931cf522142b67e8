// SPDX-License-Identifier: Apache-2.0
// A reservoir: one resampled light sample and what is needed to weigh it and to resample it again. Made and combined
// by lib/reservoir.h.
#ifndef HW_RESERVOIR_SHARED_H
#define HW_RESERVOIR_SHARED_H
#include "portable.h"
HW_NAMESPACE_BEGIN

struct Reservoir {
  uint light;  // index in the light table; HW_NONE: empty
  float u;     // where on the light, in [0, 1]^2
  float v;
  float weight;      // W: unbiased contribution weight, an estimate of 1 / pdf in the light's normalised measure
  float confidence;  // c (the paper's M): samples this one stands for; an empty reservoir has one too
  float target;      // p_hat at the surface that made it
};
HW_CONST uint HW_RESERVOIR_BYTES = 24u;
HW_CHECK_SIZE(Reservoir, HW_RESERVOIR_BYTES)

HW_NAMESPACE_END
#endif
